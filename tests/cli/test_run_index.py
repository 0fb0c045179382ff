"""An index of runs: fractions out of limit, histograms, what changed since."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import tolstat
from tests.cli.command_line import call
from tolstat.answers.index_memory import TAG, memory_of
from tolstat.answers.revisions import before_each, changes_between, revision_of
from tolstat.answers.run_entries import entry_of, stored_runs
from tolstat.answers.sketches import sketch_of
from tolstat.statistics.limits.limit import Limit
from tolstat.store.files_beside import before_of
from tolstat.units.scale import Scale

STUDY = """\
title = "Housing"
model = "dimension_chain"
trials = 4000
seed = 3
[document]
drawing = "{drawing}"
revision = "{revision}"
[settings]
gap = "A - B"
[links]
A = {{ nominal = "10 mm", tolerance = "+-{tolerance} mm" }}
B = {{ nominal = "{b} mm", tolerance = "+-0.05 mm" }}
[limits]
gap = "{limit}"
"""


def study(folder, name, **changes):
    values = {"drawing": "4711", "revision": "A", "tolerance": "0.4", "b": "9"}
    path = folder / f"{name}.toml"
    path.write_text(STUDY.format(**values | {"limit": ">= 0.8 mm"} | changes))
    return path


def named(changes):
    return {(change.kind, change.name): change[2:] for change in changes}


def rows_of(page):
    text = page.read_text("utf-8")
    table = text[text.index("What changed") :].partition("</table>")[0]
    return [re.sub(r"<[^>]+>", " ", row).split() for row in table.split("<tr>")[2:]]


@pytest.fixture(scope="module")
def revisions(tmp_path_factory):
    folder = tmp_path_factory.mktemp("revisions")
    tolstat.run(study(folder, "first"))
    tolstat.run(study(folder, "second", revision="B", tolerance="0.1", b="9.02",
                      limit=">= 0.75 mm"))  # fmt: skip
    tolstat.run(study(folder, "third", drawing="4712"))
    return folder


def test_an_index_has_the_fraction_of_the_worst_limit_with_its_interval(revisions):
    index = stored_runs(revisions)
    entry = index.entries[0]
    share = tolstat.summary(entry.run).limits["gap"].yields.fraction_out_of_limit
    assert entry.limit == "gap" and entry.fraction_out_of_limit == share
    table = index.frame()
    assert table["out_of_limit_lower"].iloc[0] == share.lower
    page = index.html()
    assert page.count('<svg class="sketch"') == 3
    assert "1</span> a limit not met" not in page  # two runs of revision A miss it
    assert "2</span> a limit not met" in page


def test_a_revision_is_compared_with_the_one_before_of_its_drawing(revisions):
    index = stored_runs(revisions).dated
    first, second, third = index.entries
    assert first.changes is None and third.changes is None
    assert second.changes.against == "first.h5"
    assert second.changes.revisions == ("A", "B")
    changes = named(second.changes.changes)
    assert changes["tolerance", "A"] == ("normal, +-0.4 mm, cp 1",
                                         "normal, +-0.1 mm, cp 1")  # fmt: skip
    assert changes["size", "B"] == ("9 mm", "9.02 mm")
    assert changes["limit", "gap"] == (">= 0.8 mm", ">= 0.75 mm")
    assert changes["verdict", "gap"] == ("not met", "met")
    before, after = changes["out of limit", "gap"]
    assert re.fullmatch(r"[\d ]+ ppm \([\d ]+ to [\d ]+\)", before), before
    assert len(changes) == 5 and "ppm" in after
    assert changes_between(first.revision, first.revision) == ()


def test_all_of_a_study_is_compared(tmp_path):
    """Formulas, correlations, links without a tolerance, measured parts."""
    parts = tmp_path / "b.csv"
    measured = {"nominal": "9.8 mm", "data": str(parts), "column": "b", "unit": "mm"}
    revisions = []
    for part, play, spare, rho, more in [
        (9.75, "A - B - C", "0.1 mm", 0.8, {}),
        (9.76, "A - B - C - 0.01 mm", "0.2 mm", 0.3, {"audit": "sure"}),
    ]:
        parts.write_text(f"b\n9.7\n9.8\n{part}\n")
        run = tolstat.run({
            "model": "dimension_chain", "trials": 200, "seed": 1, **more,
            "links": {"A": "10 +-0.1 mm", "B": measured, "C": spare},
            "gaps": {"play": play}, "correlation": {"A": {"B": rho}},
        })  # fmt: skip
        revisions.append(revision_of(run, {}))
    changes = named(changes_between(*revisions))
    assert changes["study", "gaps.play"] == ("A - B - C", "A - B - C - 0.01 mm")
    assert changes["study", "links.C"] == ("0.1 mm", "0.2 mm")
    assert changes["study", "correlation.A.B"] == ("0.8", "0.3")
    assert changes["study", "audit"] == ("", "sure")
    assert changes["data", "B"][0].startswith("3 values, digest ")
    assert not changes_between(*[revisions[0]._replace(started_at=x) for x in "ab"])
    edited = revisions[0]._replace(sources={"dimension_chain": "other"})
    assert "source" in {x.kind for x in changes_between(revisions[0], edited)}


def test_a_page_remembers_a_run_that_was_replaced(tmp_path):
    page, path = tmp_path / "index.html", study(tmp_path, "housing")
    tolstat.run(path)
    assert call("runs", tmp_path, "-o", page).exit_code == 0
    assert "What changed" not in page.read_text()
    study(tmp_path, "housing", tolerance="0.1")
    tolstat.run(path, force=True)
    assert not before_of(path.with_suffix(".h5")).exists()
    for _ in range(2):  # also of a page that was written since
        assert call("runs", tmp_path, "-o", page).exit_code == 0
        first, *_ = rows_of(page)
        assert "tolerance" in first and "+-0.4" in first and "+-0.1" in first
    crafted = json.dumps({"housing.h5": [{"drawing": 1}, None]})
    page.write_text(f"{TAG}{crafted}</script>")
    assert memory_of(page) == {}
    assert call("runs", tmp_path, "-o", page).exit_code == 0
    ((run, (latest, _)),) = memory_of(page).items()
    row = latest._asdict()
    shares = [{"gap": [x] * 4} for x in ("x", None, 10**400)]
    others = [{run: [{**row, "fractions_out_of_limit": x}, None]} for x in shares]
    for crafted in ("[" * 100_000, *map(json.dumps, [{run: [None, None]}, *others])):
        page.write_text(f"{TAG}{crafted}</script>")
        assert memory_of(page) == {}


def test_a_batch_remembers_and_links(tmp_path, no_pages):
    path = study(tmp_path, "housing")
    assert call("batch", path).exit_code == 0
    study(tmp_path, "housing", tolerance="none")
    assert call("batch", path).exit_code == 2  # it has no run in between
    study(tmp_path, "housing", tolerance="0.1")
    tolstat.run(path, force=True)
    assert call("batch", path).exit_code == 0
    first, *_ = rows_of(tmp_path / "batch.html")
    assert (
        "+-0.4" in first
        and 'href="housing.html"' in (tmp_path / "batch.html").read_text()
    )


def test_files_without_a_run_are_in_the_index_in_words(tmp_path):
    (tmp_path / "other.h5").write_text("no run at all")
    tolstat.run(study(tmp_path, "good"))
    page = tmp_path / "index.html"
    done = call("runs", tmp_path, "-o", page)
    assert done.exit_code == 1
    text = page.read_text()
    assert "no run" in text and "is not a run of tolstat" in text
    assert "1 problem" in re.sub(r"<[^>]+>", "", text)
    assert call("runs", tmp_path, "-o", tmp_path / "index.txt").exit_code == 2


def test_the_order_is_that_of_the_runs_and_not_of_their_names(revisions):
    first, second, third = (x.revision for x in stored_runs(revisions).entries)
    assert before_each([second, None, first, third]) == [2, None, None, None]


def test_a_run_before_is_named_by_its_folder(tmp_path):
    for name in ("x", "y"):
        (tmp_path / name).mkdir()
        tolstat.run(study(tmp_path / name, "a"))
    _, second = stored_runs(tmp_path).dated.entries
    assert second.changes.against == "x/a.h5"


def test_a_bar_of_a_sketch_is_within_its_limit_or_out_of_it():
    values = np.random.default_rng(2).normal(0.0, 1.0, 20_000)
    limit = Limit(-np.inf, 1.5)
    sketch = sketch_of("x", values, limit, Scale("m", "m"))
    edges, heights = np.array(sketch.edges), np.array(sketch.heights)
    assert 1.5 in sketch.edges and sketch.ends == (1.5,)
    for left, right, out in zip(edges, edges[1:], sketch.out_of_limit, strict=False):
        assert out == (left >= 1.5) and out == (right > 1.5)
    assert heights.max() == 1.0 and (heights >= 0).all()
    assert sketch_of("x", np.zeros(0), limit, Scale("m", "m")) is None
    still = sketch_of("x", np.full(5, 2.0), limit, Scale("m", "m"))
    assert max(still.heights) == 1.0 and any(still.out_of_limit)


def test_a_run_without_limits_has_no_fraction(tmp_path):
    path = study(tmp_path, "free")
    path.write_text(path.read_text().partition("[limits]")[0])
    entry = entry_of(tolstat.run(path))
    assert entry.limit == "" and entry.sketch is None
