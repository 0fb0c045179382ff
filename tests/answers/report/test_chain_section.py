"""What a report says of a chain, as on the drawing; tables of trials in sizes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

import tolstat
from tests.answers.page_checks import number_in, rows_of, words_of
from tolstat.answers.report.chain_section import chain_blocks, links_table
from tolstat.errors import QuestionError, UnitError
from tolstat.render.screen import as_text
from tolstat.statistics.intervals.shortest import shortest_interval


@pytest.fixture(scope="module")
def run():
    chain = tolstat.Chain(trials=2000).link("seat", "25 +0.1/-0.05 mm")
    chain = chain.link("ring", "24.8 h8 mm").link("shim", "0.05 mm")
    chain = chain.gap("play", "seat - ring - shim").limit("play", ">= 0 mm")
    return chain.run()


def texts_of(report):
    """Return the words of the page of a report."""
    return " ".join(re.sub(r"<[^>]+>", " ", report.html()).split())


def test_links_stand_as_on_the_drawing(run):
    links, _, ways, _ = chain_blocks(run.report(), "play")
    seat, ring = (" ".join(map(words_of, row)) for row in links.rows)
    assert seat.startswith("seat  25 mm  +0.1 mm  -0.05 mm  25.025 mm  increasing")
    assert ring.startswith("ring  24.8 mm  0 mm  -0.033 mm  24.7835 mm  decreasing")
    assert seat.endswith("normal, +0.1/-0.05 mm, cp 1 ")
    worst, square, trials = rows_of(ways)
    assert as_text(worst["least, mm"].main) == "0.1 mm"
    assert as_text(worst["largest, mm"].main) == "0.283 mm"
    assert not any(worst[head] for head in worst if head == "ppm" and worst[head].main)
    assert number_in(square["ppm"]) == pytest.approx(ndtr(-mean_of(square)), rel=1e-9)
    limited = run.report().responses["play"].limited
    assert number_in(trials["ppm"]) == limited.yields.fraction_out_of_limit
    assert number_in(trials["Ppk"]) == limited.moments.ppk


def mean_of(row):
    """Mean of a normal response, in sigmas."""
    return number_in(row["mean, mm"]) / number_in(row["sigma, mm"])


def test_only_a_model_with_a_worst_case_has_a_chain():
    fit = tolstat.as_model(inputs={"a": "1 mm", "b": "2 mm"}, outputs={"x": "mm^2"})
    chain = tolstat.Chain(model=fit(lambda a, b: a * b), trials=100)
    run = chain.link("a", "1 +-0.1 mm").limit("x", "<= 3 mm^2").run()
    assert chain_blocks(run.report(), "x") == ()


def test_a_distance_that_is_least_at_the_nominal_trial_has_a_page():
    """By symmetry no link has a slope: there is no chain of lengths to draw."""
    chain = tolstat.Chain(trials=100).link("x", "0 +-0.1 mm").link("y", "0 +-0.1 mm")
    for formula in ("2*hypot(x, y)", "0.2 mm - 2*hypot(x, y)"):
        run = chain.gap("off", formula).limit("off", "<= 0.2 mm").run()
        assert "Histogram of off" in run.report().html()


def test_requested_quantiles_stand_with_the_shortest_interval(run):
    report = tolstat.report(run, quantiles=(0.975, 0.025))
    requested = report.responses["play"].requested
    low, high = requested.quantiles.values()
    exact = np.quantile(run.column("play"), [0.025, 0.975], method="median_unbiased")
    assert [low.value, high.value] == pytest.approx(exact)
    lower, upper = requested.shortest
    assert upper - lower <= high.value - low.value
    assert "The shortest interval with 95 % of the trials" in texts_of(report)
    with pytest.raises(QuestionError, match="quantile 95: a share between"):
        tolstat.report(run, quantiles=[95])


def test_worst_trials_show_sizes(run):
    page = run.report().html()
    assert "24.8" in page[page.index("Worst trials") :]


def test_a_table_has_sizes_in_the_units_shown(run):
    deviations, sizes = run.frame(), run.frame("shown")
    np.testing.assert_allclose(sizes["seat"], 25 + 1e3 * deviations["seat"])
    np.testing.assert_allclose(sizes["play"], 1e3 * deviations["play"])
    assert sizes.attrs["units"] == {
        "seat": "mm", "ring": "mm", "shim": "mm", "play": "mm",
    }  # fmt: skip
    other = run.frame({"play": "um"})
    np.testing.assert_allclose(other["play"], 1e6 * deviations["play"])
    assert deviations.attrs["units"]["seat"] == "m"
    for units, words in [("mm", "allowed: SI, shown"), ({"plai": "mm"}, "did you mean"),
                         ({"play": "deg"}, "of another kind")]:  # fmt: skip
        with pytest.raises(UnitError, match=words):
            run.frame(units)


def test_the_shortest_interval_of_an_exponential_begins_at_zero():
    values = stats.expon.rvs(size=20_000, random_state=1)
    lower, upper = shortest_interval(values, 0.95)
    assert lower < 0.01 and upper == pytest.approx(-np.log(0.05), rel=0.03)
    assert shortest_interval(np.array([3.0, 1.0, 2.9, 2.8]), 0.75) == (2.8, 3.0)
    assert np.isnan(shortest_interval(np.array([]), 0.5)).all()


def test_measured_parts_have_the_deviations_of_the_drawing(tmp_path):
    file = tmp_path / "run.h5"
    run = tolstat.run("runs/measured-parts.toml", trials=100, output=file)
    report = tolstat.report(run)
    cover = rows_of(links_table(report, "gap"))[2]
    assert as_text(cover["upper deviation"].main) == "+0.04 mm"
    assert as_text(cover["lower deviation"].main) == "-0.04 mm"
    assert as_text(cover["distribution"].main) == "measured"
    words = "from tolerances and measured parts: worst_min"
    assert any(words in note for note in report.trials.notes)
