"""The page of a grid or a table: limits met, best and worst trial, picture, steps."""

from __future__ import annotations

import json
import re
import shlex

import numpy as np
import pytest
from click.testing import CliRunner

import tolstat
from tests.answers.browser import scroll_widths
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.next_steps import StepKind
from tolstat.cli.main import main
from tolstat.document.blocks import Figure, Section
from tolstat.model.view import Curve
from tolstat.render.screen import as_text

CHAIN = {
    "model": "dimension_chain", "sampling": "grid",
    "settings": {"gap": "H - a - b"},
    "links": {n: {"nominal": x} for n, x in
              {"H": "10 mm", "a": "4 mm", "b": "5 mm"}.items()},
    "grid": {
        "a": {"from": "0 mm", "to": "1.5 mm", "points": 16},
        "b": {"from": "0 mm", "to": "1.4 mm", "points": 15},
    },
    "limits": {"gap": ">= 0.05 mm"},
}  # fmt: skip


@pytest.fixture
def grid(tmp_path):
    return tolstat.run(CHAIN, output=tmp_path / "grid.h5")


class Sides(Model):
    """A beam of width w and height 2: its area, and its slenderness."""

    name = "sides"

    def describe(self, settings):
        responses = (
            Response("area", "m^2", "A"),
            Response("slenderness", "1", "s", shown="1"),
        )
        return Description((Contributor("width", "m", "w"),), responses)

    def evaluate(self, deviations, settings):
        width = 1 + deviations[:, 0]
        return Outcome(np.column_stack([2 * width, 2 / width]))


def test_limits_best_and_worst_agree_with_the_closed_form(grid):
    """The gap is 1 mm - a - b: met where i + j < 10 tenths."""
    found = tolstat.report(grid)
    assert found.meet_all == sum(i + j < 10 for i in range(16) for j in range(15))
    assert found.best.at == "a 0 mm, b 0 mm"
    assert found.worst.at == "a 1.5 mm, b 1.4 mm" and found.worst.trial == 239
    assert found.worst.value == pytest.approx(-1.9e-3)
    said = as_text(found.document().blocks[0].blocks[3].parts)
    assert said.startswith("55 of 240 combinations meet the limit. Best: a 0 mm, b")


def test_next_steps_of_a_grid_are_data(grid):
    kinds = StepKind.SEE_WORST, StepKind.WRITE_TABLE
    steps = json.loads(tolstat.report(grid).json())["findings"]["steps"]
    assert [step["kind"] for step in steps] == [*kinds]
    (table,) = tolstat.report(tolstat.run(CHAIN)).findings.steps[1].commands
    assert table.text == "tolstat export run.h5 -o run.csv"
    assert steps[0]["commands"] == [
        shlex.join(["tolstat", "trial", f"{grid.path}", "239"])
    ]


def test_of_two_limits_the_one_that_decides_is_drawn(tmp_path):
    """Distances 1 - 2 d and 0.8 - 2 / (1 + d) + 1, over the largest of each."""
    grid = {"width": {"from": "-0.4 m", "to": "0.6 m", "points": 11}}
    study = {"model": "sides", "sampling": "grid", "grid": grid,
             "limits": {"area": "<= 3 m^2", "slenderness": "<= 2.8"}}  # fmt: skip
    run = tolstat.run(study, model=Sides(), output=tmp_path / "sides.h5")
    found, d = tolstat.report(run), np.linspace(-0.4, 0.6, 11)
    area, slender = 1 - 2 * d, 2.8 - 2 / (1 + d)
    least = np.minimum(area / 1.8, slender / 1.55)
    assert found.best.trial == least.argmax() and found.worst.trial == least.argmin()
    assert (found.worst.response, found.focus) == ("slenderness", ("slenderness",))
    assert found.meet_all == np.sum((area > -1e-12) & (slender > 0))


def test_the_picture_has_every_trial_in_the_plane_of_both_axes(grid):
    first, *_ = tolstat.report(grid).document().blocks
    (drawn,) = (b for section in first.blocks if isinstance(section, Section)
                for b in section.blocks if isinstance(b, Figure))  # fmt: skip
    (panel,) = drawn.picture.panels
    assert (panel.x.label, panel.y.label) == ("a, mm", "b, mm")
    met, out = (each for each in panel.layers if isinstance(each, Curve))
    assert len(met.at) == 55 and len(out.at) == 185
    assert (met.at + met.values).max() < 0.95e-3 < (out.at + out.values).min()


def test_the_commands_of_the_page_run(grid, tmp_path):
    page = tmp_path / "grid.html"
    shown = CliRunner().invoke(main, ["show", str(grid.path)]).output
    typed = re.findall("^   tolstat (.*)$", shown, re.MULTILINE)
    assert [each.split()[0] for each in typed] == ["trial", "export"]
    typed.append(f"report {grid.path}")
    for each in typed:
        assert CliRunner().invoke(main, shlex.split(each)).exit_code == 0
    assert page.is_file() and (tmp_path / "grid.csv").is_file()
    assert scroll_widths(page, tmp_path, [390, 1100]) == [390, 1100]


def test_the_sentence_that_all_limits_are_met_fits_a_phone(tmp_path):
    run = tolstat.run(CHAIN | {"limits": {"gap": ">= -9 mm"}}, output=tmp_path / "m.h5")
    page = tolstat.report(run).save(tmp_path / "m.html")
    assert "240 of 240 combinations meet the limit" in page.read_text()
    assert scroll_widths(page, tmp_path, [390]) == [390]


def test_a_table_and_a_single_point_have_a_page(tmp_path):
    (tmp_path / "cases.csv").write_text("a [mm],b [mm]\n0,0\n0.5,0.6\n0.1,0.2\n")
    table = {k: v for k, v in CHAIN.items() if k != "grid"} | {"sampling": "table"}
    run = tolstat.run(
        {**table, "table": str(tmp_path / "cases.csv")}, output=tmp_path / "table.h5"
    )
    found = tolstat.report(run)
    assert (found.best.at, found.worst.at, found.meet_all) == ("trial 0", "trial 1", 2)
    assert "2 of 3 trials meet the limit" in found.html()
    one = tolstat.run(CHAIN | {"grid": {"a": ["0 mm"]}}, output=tmp_path / "one.h5")
    assert "1 of 1 point meets the limit" in tolstat.report(one).html()
