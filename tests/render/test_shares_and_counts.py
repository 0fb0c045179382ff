"""A share of few trials is a count; its interval stays a share."""

from __future__ import annotations

import pytest

import tolstat
from tests.answers.page_checks import rows_of, table_under, words_in
from tolstat.document.inline import FEW, Number, in_cell, in_line, plain
from tolstat.render.screen import as_text
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import PER_CENT, PPM

CHAIN = {
    "model": "dimension_chain", "seed": 11, "settings": {"gap": "a - b"},
    "links": {
        "a": {"nominal": "10 mm", "tolerance": "+-0.1 mm"},
        "b": {"nominal": "10 mm", "tolerance": "+-0.1 mm"},
    },
    "limits": {"gap": "-0.05..0.05 mm"},
}  # fmt: skip


def test_a_share_of_few_trials_is_a_count():
    share = Estimate(6 / 7, 0.421, 0.996)
    assert plain(in_line(Number(share, PER_CENT, of=7))) == "6 of 7 (42.1 to 99.6 %)"
    value, ends = in_cell(Number(share, PPM, of=7))
    assert (plain(value), plain(ends)) == ("6 of 7", "421000 to 996000")
    # also without an interval, and as a bound: 6 of 7 are not at most 85.8 %
    assert plain(in_line(Number(6 / 7, PER_CENT, "at_most", 7))) == "6 of 7"
    assert plain(in_line(Number(0.0, PER_CENT, of=7))) == "0 of 7"


@pytest.mark.parametrize(
    ("share", "of"), [(6 / 7, 0), (0.5, FEW), (0.4, 7), (float("nan"), 7)]
)
def test_other_shares_stay_shares(share, of):
    """Of many trials, or of weighted ones: no whole number of them."""
    assert " of " not in plain(in_line(Number(share, PER_CENT, of=of)))


def test_a_run_of_few_trials_counts_them(tmp_path):
    def run(trials, seed):
        study = {**CHAIN, "trials": trials, "seed": seed}
        return tolstat.run(study, output=tmp_path / f"{trials}-{seed}.h5")

    few, other, many = run(20, 1), run(20, 2), run(40, 1)
    out = int(few.beyond("gap").sum())
    document = tolstat.summary(few).document()
    (row,) = rows_of(table_under(document, "Limits"))
    assert plain(in_cell(row["out of limit, ppm"].main[0])[0]) == f"{out} of 20"
    assert f"Yield, this limit: {20 - out} of 20 (" in words_in(*document.blocks)
    words = words_in(*tolstat.summary(many).document().blocks)
    assert "of 40 (" not in words and " % (" in words
    compared = words_in(*tolstat.compare(few, other).document().blocks)
    assert compared.count(f"{out} of 20") >= 2  # verdict, difference


def test_one_fraction_has_the_same_digits_wherever_it_stands(tmp_path):
    """Intervals for one look and for any number of looks are of different width."""
    runs = [
        tolstat.run(
            {**CHAIN, "trials": 4100, "seed": seed, "limits": {"gap": "<= 0.15 mm"}},
            output=tmp_path / f"{seed}.h5",
        )
        for seed in (1, 2)
    ]
    document = tolstat.compare(*runs).document()
    rows = rows_of(table_under(document, "Verdicts"))
    verdicts = [plain(in_cell(r["out of limit, ppm"].main[0])[0]) for r in rows]
    (row,) = rows_of(table_under(document, "Out of limit, and equivalent Ppk"))
    own = [plain(in_cell(row[head].main[0])[0]) for head in ("ppm: A", "ppm: B")]
    assert own == verdicts
    for words, run in zip(own, runs, strict=True):
        share = 1e6 * run.beyond("gap").mean()
        assert float(words) == pytest.approx(share, rel=5e-3)
    assert float(own[0]) > 0
    assert as_text(row["response"].main) == "gap"
