"""Two designs of the same machines: differences by hand, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.conftest import Toy
from tests.store.tampering import resealed
from tolstat.answers.compare.comparison import compared, compared_with_first
from tolstat.answers.compare.comparison_table import comparison_table
from tolstat.answers.compare.pairing import pair_of
from tolstat.errors import PictureError
from tolstat.render.plain import plain


def test_differences_are_machine_by_machine(mill, linked):
    found = plain(compared(pair_of(mill, linked)))
    difference = linked.column("rod_force_1") - mill.column("rod_force_1")
    each = found["responses"]["rod_force_1"]
    known = np.quantile(difference, 0.95, method="median_unbiased")
    assert each["difference"]["quantiles"]["95 %"]["value"] == pytest.approx(known)
    assert each["difference"]["mean"]["value"] == pytest.approx(difference.mean())
    smaller = int((difference < 0).sum())
    assert each["smaller"]["value"] == smaller / 2200
    low = stats.beta.ppf(0.025, smaller, 2200 - smaller + 1)
    assert each["smaller"]["lower"] == pytest.approx(low)
    assert found["settings"] == {"variant": ["indeterminate", "equalized"]}
    assert found["trials"]["done_in_both"] == 2200
    assert found["interest"][0] == "extra_loss"
    # a link that shares the load never lets the carriage jam
    assert found["responses"]["jam_share"]["larger"]["value"] == 0


def test_the_screen_shows_the_difference_of_quantiles_and_promises_one_look(
    mill, linked
):
    """That of the quantiles beside it, as a reader takes it."""
    _, comparison = compared_with_first([mill, linked])
    table, found = comparison_table(comparison), comparison.alone
    row = next(row for row in table.rows if row[0] == "rod_force_1")
    a, b, less = (float(row[i][0]) for i in (2, 3, 5))
    assert table.heads[5] == "B - A: 95 %"
    assert less == pytest.approx(b - a, abs=0.02)
    known = found.responses["rod_force_1"]
    differences = known.difference.quantiles[0.95].value / known.scale.factor
    assert abs(less - differences) > 0.1
    text = " ".join(table.notes)
    assert "at every look" not in text + found.trials.promise
    assert "at one look" in found.trials.promise in text


def test_a_run_differs_from_itself_by_nothing(mill):
    _, comparison = compared_with_first([mill, mill], ["yaw"])
    found = plain(comparison.alone)
    for each in found["responses"].values():
        assert each["difference"]["least"] == each["difference"]["largest"] == 0
        assert each["smaller"]["value"] == each["larger"]["value"] == 0
    assert found["interest"] == ["yaw"] and found["settings"] == {}
    table = comparison_table(comparison)
    assert table.rows[0][0] == "extra_loss" and len(table.heads) == len(table.rows[0])


@pytest.fixture
def other(toy, toy_study, tmp_path):
    """Run the toy study with something else in it."""

    def run(*changes, name="other.h5"):
        text = toy_study.read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        study = tmp_path / "other.toml"
        study.write_text(text)
        return tolstat.run(study, model=toy, output=tmp_path / name, force=True)

    return run


def test_differences_that_are_all_alike_are_drawn(toy, tmp_path):
    """But for rounding: no sixty bars have room between them."""
    runs = []
    for name, mode in (("a", "plain"), ("b", "odd")):
        study = {
            "model": "toy", "trials": 400, "seed": 1, "title": "$\\foo{ x",
            "settings": {"mode": mode}, "deviations": {"part": "+-0.1 mm"},
        }  # fmt: skip
        runs.append(tolstat.run(study, model=toy, output=tmp_path / f"{name}.h5"))
    table = runs[1].path
    with resealed(table) as file:
        file["gap"][...] = np.nextafter(file["gap"][...] + 1e-3, 1)
    page = tmp_path / "pair.html"
    tolstat.compare(runs[0].path, table, page, ["gap"])
    assert "mathdefault" not in page.read_text()


def test_machines_that_failed_in_either_are_left_out_and_counted(other):
    base, twice = (
        other(name="base.h5"),
        other(("[limits]", "[settings]\ngain = 4\n[limits]")),
    )
    found = plain(compared(pair_of(base, twice)))
    failed = base.counts["not finite"]
    assert found["trials"]["failed"] == failed > 0
    gap = found["responses"]["gap"]
    assert gap["difference"]["mean"]["value"] == pytest.approx(
        np.nanmean(base.column("gap")), rel=1e-9
    )
    assert found["responses"]["ratio"]["difference"]["largest"] == 0


def test_machines_that_were_chosen_have_no_statistics(toy, tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm", "1 mm"]\n'
    )
    run = tolstat.run(study, model=toy)
    with pytest.raises(PictureError, match="chosen and not drawn"):
        pair_of(run, run)


def kind_of(base, other):
    pair = pair_of(base, other)
    return pair.kind, pair.words


def test_what_two_runs_have_in_common_is_found_in_their_deviations(other):
    base = other(name="base.h5")
    assert kind_of(base, base)[0] == "same machines"
    kind, words = kind_of(base, other(("+-1 mm", "+-0.4 mm")))
    assert kind == "same qualities" and "widths differ: part_1, part_2" in words
    uniform = '{ tolerance = "0..2 mm", distribution = "uniform" }'
    kind, _ = kind_of(base, other(('"+-1 mm"', uniform)))
    assert kind == "same qualities"
    assert kind_of(base, other(("seed = 1", "seed = 2"))) == (
        "unpaired", "seeds 1 and 2"
    )  # fmt: skip
    sobol = ("[deviations]", 'sampling = "sobol"\n[deviations]')
    kind, words = kind_of(base, other(sobol))
    assert (kind, words) == ("unpaired", "samplings random and sobol")
    # asked what it was drawn from, and not what it says of itself
    liar = other(("seed = 1", "seed = 2"))
    told = replace(liar, sampled=liar.sampled._replace(seed=1))
    assert kind_of(base, told)[0] == "unpaired"


def test_parts_that_hang_together_otherwise_are_named(other):
    base = other(name="base.h5")
    correlated = "[correlation]\npart_1 = { part_2 = 0.6 }\n[limits]"
    kind, words = kind_of(base, other(("[limits]", correlated)))
    assert kind == "same qualities" and words.endswith("hang together: part_2")


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin", "saltelli"])
def test_more_trials_are_paired_where_the_first_stay_what_they_were(other, sampling):
    drawn = ("[deviations]", f'sampling = "{sampling}"\n[deviations]')
    base = other(drawn, name="base.h5")
    more = other(drawn, ("1000", "2000"), ("+-1 mm", "+-0.5 mm"))
    pair = pair_of(base, more)
    if sampling == "latin":
        assert pair.kind == "unpaired" and pair.sample is None
        return
    assert pair.kind == "same qualities"
    assert f"of both the first {len(pair.first.trials)} trials" in pair.words
    first, second = pair.done("gap")
    assert second == pytest.approx(first / 2)


def test_yields_are_compared_by_the_limit_of_each(other):
    base = other(name="base.h5")
    tight = other(("+-1 mm", "+-0.8 mm"), ("-1..2 mm", "-0.5..0.5 mm"))
    found = compared(pair_of(base, tight)).responses["gap"].yields
    assert found.limits == ("-1..2 mm", "-0.5..0.5 mm")
    within = [
        (run.column("gap") >= low) & (run.column("gap") <= high)
        for run, low, high in ((base, -1e-3, 2e-3), (tight, -0.5e-3, 0.5e-3))
    ]
    assert found.worse == np.count_nonzero(within[0] & ~within[1]) > 0
    assert found.better == np.count_nonzero(~within[0] & within[1])
    assert found.beyond[1].value == 1 - within[1].mean()
    assert found.beyond_more.value == pytest.approx(within[0].mean() - within[1].mean())
    unlimited = other(('[limits]\ngap = "-1..2 mm"\n', ""))
    found = compared(pair_of(base, unlimited)).responses["gap"].yields
    assert found.limits == ("-1..2 mm", "-1..2 mm")
    assert found.worse == found.better == 0
    none = compared(pair_of(unlimited, unlimited))
    assert none.responses["gap"].yields is None


def test_an_unpaired_run_is_compared_as_what_it_is(other):
    base = other(name="base.h5")
    new = other(("seed = 1", "seed = 2"), ("1000", "700"))
    found = plain(compared(pair_of(base, new)))
    assert found["trials"]["kind"] == "unpaired"
    each = found["responses"]["gap"]
    assert each["difference"] is None and each["smaller"]["reason"] == "unpaired"
    means = [np.nanmean(run.column("gap")) for run in (base, new)]
    shift = each["shift"]["mean"]
    assert shift["value"] == pytest.approx(means[1] - means[0])
    sigma = np.hypot(
        *(np.nanstd(r.column("gap")) / np.sqrt(r.ended) for r in (base, new))
    )
    half = (shift["upper"] - shift["lower"]) / 2
    assert 1.96 * sigma < half < 4 * 1.96 * sigma
    assert (
        each["yields"]["worse"] is None and each["yields"]["beyond_more"]["lower"] < 0
    )


def test_a_page_of_several_runs_says_how_each_goes_with_the_first(other, tmp_path):
    base = other(name="base.h5")
    half = other(("+-1 mm", "+-0.5 mm"), name="half.h5")
    new = other(("seed = 1", "seed = 2"), ("1000", "700"))
    page = tmp_path / "several.html"
    assert tolstat.compare(base.path, half, page, ["gap"], [new]) == page
    text = page.read_text()
    for words in (
        "B and A: same qualities", "C and A: unpaired", "Machines beyond, C less A",
        "Differences, B less A, machine by machine", "Differences, C less A, unpaired",
    ):  # fmt: skip
        assert words in text.replace("<strong>", "").replace("</strong>", "")
    assert text.count("<svg") == 3 + 1  # of what is unpaired the distributions alone


@pytest.mark.parametrize("sampling", ["sobol", "latin"])
def test_dependent_trials_are_compared_by_their_replicates(other, sampling):
    drawn = ("[deviations]", f'sampling = "{sampling}"\n[deviations]')
    base, half = other(drawn, name="a.h5"), other(drawn, ("+-1 mm", "+-0.5 mm"))
    found = compared(pair_of(base, half)).responses["gap"]
    assert found.yields.beyond_more.upper < 0 and found.yields.worse == 0
    assert found.yields.ppk_more.reason == found.shift.quantiles[0.95].reason
    assert "random trials only" in found.yields.ppk_more.reason


def test_runs_of_two_machines_are_refused(toy, toy_study, tmp_path):
    """Both may have a gap."""

    class Other(Toy):
        name = "other"

    text = toy_study.read_text()
    first = tolstat.run(toy_study, model=toy, trials=30, output=tmp_path / "a.h5")
    toy_study.write_text(text.replace('model = "toy"', 'model = "other"'))
    second = tolstat.run(toy_study, model=Other(), trials=30, output=tmp_path / "b.h5")
    with pytest.raises(PictureError, match="two machines, toy and other"):
        pair_of(first, second)
