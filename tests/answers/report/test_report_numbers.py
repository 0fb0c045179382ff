"""Numbers of a report, computed again from the stored columns."""

from __future__ import annotations

import csv
import io
import json
import re
from functools import partial

import h5py
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from scipy import stats

import tolstat
from tests.conftest import Toy
from tolstat.answers.report import main_causes as contributing
from tolstat.answers.report.full_report import report_of
from tolstat.answers.report.main_causes import at_most_all
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.cli.main import main
from tolstat.errors import QuestionError
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity import sobol_indices as indices_module
from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.sensitivity.sobol_indices import Indices, sobol_indices


def said(run):
    """Return what the JSON of a report says."""
    return json.loads(report_of(run).json())


@pytest.fixture(scope="module")
def found(mill):
    return said(mill)


@pytest.fixture(scope="module")
def columns(mill):
    with h5py.File(mill.path) as file:
        return {n: d[:] for n, d in file.items() if isinstance(d, h5py.Dataset)}


def ever_looked_at(count, n):
    """Shares at which neither a smaller nor a larger one was ever 40 times likelier.

    Averaged over Jeffreys' prior, and found on a grid.
    """
    p = np.concatenate([np.geomspace(1e-9, 1e-2, 40_001), np.linspace(0.01, 1, 4001)])
    mass = np.diff(stats.beta.cdf(p, 0.5, 0.5), prepend=0.0)
    log = stats.binom.logpmf(count, n, p)
    likelihood = np.exp(log - log.max()) * mass
    with np.errstate(divide="ignore", invalid="ignore"):
        smaller = np.cumsum(likelihood) / np.cumsum(mass)
        larger = np.cumsum(likelihood[::-1])[::-1] / np.cumsum(mass[::-1])[::-1]
        possible = 40 * np.exp(log - log.max()) > np.maximum(smaller, larger)
    return p[possible].min(), p[possible].max()


def test_summaries_match_the_stored_columns(found, columns):
    assert (columns["status"] == 1).all()
    for name, each in found["responses"].items():
        x = np.sort(columns[name])
        n = len(x)
        assert each["least"] == x[0] and each["largest"] == x[-1]
        assert each["mean"]["value"] == pytest.approx(x.mean())
        assert each["sigma"]["value"] == pytest.approx(x.std(ddof=1))
        for words, quantile in each["quantiles"].items():
            share = float(words.removesuffix(" %")) / 100
            known = np.quantile(x, share, method="median_unbiased")
            assert quantile["value"] == pytest.approx(known)
            low = int(stats.binom.ppf(0.025, n, share))
            high = int(stats.binom.ppf(0.975, n, share)) + 1
            if low >= 1 and high <= n:
                assert (quantile["lower"], quantile["upper"]) == (
                    x[low - 1],
                    x[high - 1],
                )
            else:
                assert quantile["lower"] is None
                assert quantile["reason"].startswith("needs")


def test_limits_match_the_stored_columns(mill, found, columns):
    for name, (lower, upper, *_) in mill.limits.items():
        x, limit = columns[name], found["responses"][name]["limited"]
        beyond = int(((x < lower) | (x > upper)).sum())
        known = ever_looked_at(beyond, len(x))
        assert limit["yields"]["fraction_out_of_limit"]["value"] == beyond / len(x)
        found_ends = (
            limit["yields"]["fraction_out_of_limit"]["lower"],
            limit["yields"]["fraction_out_of_limit"]["upper"],
        )
        assert found_ends == pytest.approx(known, rel=0.02, abs=2e-6)
        good = limit["yields"]["within"]
        assert good["value"] == pytest.approx(1 - beyond / len(x))
        assert good["lower"] == pytest.approx(1 - found_ends[1])
        q = np.quantile(x, [0.5, 0.99865], method="median_unbiased")
        ppk = limit["percentiles"]["ppk"]
        assert ppk["value"] == pytest.approx((upper - q[0]) / (q[1] - q[0]))
        share = limit["equivalent_ppk"]["value"]
        assert share == pytest.approx(-stats.norm.ppf(beyond / len(x)) / 3)
        assert limit["moments"]["ppk"]["value"] == pytest.approx(
            (upper - x.mean()) / (3 * x.std(ddof=1))
        )
        verdict = {
            "met": good["lower"] >= 0.9973, "not met": good["upper"] < 0.9973,
        }  # fmt: skip
        assert limit["yields"]["verdict"] == next(
            (v for v in verdict if verdict[v]), "undecided"
        )


def test_trials_within_all_limits_are_counted(mill, found, columns):
    within = np.ones(mill.trials, bool)
    for name, (lower, upper, *_) in mill.limits.items():
        within &= (columns[name] >= lower) & (columns[name] <= upper)
    joint = found["all_limits"]
    assert joint["within"]["value"] == within.mean() and joint["limits"] == 5
    assert joint["within"]["lower"] < within.mean() < joint["within"]["upper"]
    assert joint["wrongly_met"] == pytest.approx(5 * 0.025)


def test_contributions_match_the_stored_columns(mill, found, columns):
    deviating = {
        c.name: columns[c.name] for c in mill.contributors if c.name in mill.assumed
    }
    name = "shaft_9_moment"
    known = contributions(deviating, {name: columns[name]})[name]
    shares = found["responses"][name]["contributions"]
    for part, estimate in known.first_order.items():
        assert shares["first_order"][part]["value"] == pytest.approx(estimate.value)
        assert shares["first_order"][part]["upper"] == pytest.approx(estimate.upper)
    assert shares["unexplained"]["value"] == pytest.approx(known.unexplained.value)


def test_a_point_mass_is_reported_separately(found):
    """Most machines never jam: the distribution is said of those that do."""
    mass = found["responses"]["extra_loss"]["point_mass"]
    assert 0.9 < mass["share"]["value"] < 0.99
    assert mass["largest"] < 1e-5
    jam = found["responses"]["jam_share"]["point_mass"]
    assert jam["value"] == 0.0 and jam["largest"] == 0.0


def test_json_has_the_same_numbers(mill, found):
    again = json.loads(report_of(mill).json())
    assert again["responses"]["yaw"]["mean"] == found["responses"]["yaw"]["mean"]


def test_the_csv_table_has_findings_in_its_units(mill, found, columns):
    table = pd.read_csv(io.StringIO(report_of(mill).csv())).set_index("response")
    assert list(table.index) == list(found["responses"])
    times = {"%": 100, "kN": 1e-3, "kJ": 1e-3, "J": 1, "kN m": 1e-3, "mrad": 1e3}
    times |= {"count": 1, "m/s": 1}
    for name, row in table.iterrows():
        shown = times[row["unit"]]
        for head, known in (
            ("mean [unit]", columns[name].mean()),
            ("largest [unit]", columns[name].max()),
            ("50 % [unit]", np.quantile(columns[name], 0.5, method="median_unbiased")),
        ):
            assert row[head] == pytest.approx(shown * known, rel=1e-9)
        limited = found["responses"][name]["limited"]
        if limited is None:
            assert row.loc["lower limit [unit]":"Ppk by percentiles upper"].isna().all()
            continue
        beyond = limited["yields"]["fraction_out_of_limit"]
        assert row["fraction out of limit lower [ppm]"] == pytest.approx(
            1e6 * beyond["lower"]
        )
        assert row["verdict"] == limited["yields"]["verdict"]
        assert row["yield [%]"] == pytest.approx(100 * (1 - beyond["value"]))
        assert np.isnan(row["lower limit [unit]"])  # open
        assert row["upper limit [unit]"] == pytest.approx(
            shown * mill.limits[name].permitted[1]
        )
        finding = found["findings"]["limits"][name]
        causes = ["; ".join(map(", ".join, finding["causes"])), finding["no_cause"]]
        assert row[["main causes", "no cause"]].fillna("").tolist() == causes
        assert row["trials that decide"] == finding["trials_that_decide"]
    assert table.loc["extra_loss", "upper limit [unit]"] == 3.0
    assert (table["trials done"] == 2200).all() and (table["trials failed"] == 0).all()


def test_infinite_numbers_stay_valid_json(tmp_path, toy_study):
    toy_study.write_text(toy_study.read_text().replace('part = "+-1 mm"\n', ""))
    run = tolstat.run(toy_study, model=Toy())
    text = report_of(run).json()
    json.loads(text, parse_constant=lambda word: pytest.fail(word))
    assert '"inf"' in text


def test_failed_trials_improve_no_number(toy, toy_study):
    run = tolstat.run(toy_study, model=toy)
    found = said(run)
    failed = found["trials"]["failed"]
    assert failed == run.counts["not finite"] > 0
    limit = found["responses"]["gap"]["limited"]
    bad, good = limit["yields"]["within"], limit["yields"]["within_at_most"]
    assert good["value"] - bad["value"] == pytest.approx(failed / 1000)
    assert limit["yields"]["fraction_out_of_limit"]["value"] >= failed / 1000
    share = found["trials"]["failures"]
    assert share["lower"] < failed / 1000 < share["upper"]
    assert found["responses"]["gap"]["mean"]["value"] is not None


def test_indices_of_a_saltelli_run(toy, toy_study, monkeypatch):
    text = toy_study.read_text().replace("trials = 1000", "trials = 5000")
    toy_study.write_text(
        'sampling = "saltelli"\n' + text.replace('"+-1 mm"', '"+-0.5 mm"')
    )
    run = tolstat.run(toy_study, model=toy)
    found = said(run)
    assert found["trials"]["counted"] == 2000  # A and B of groups of five
    x = run.column("gap").reshape(-1, 5)
    quantile = found["responses"]["gap"]["quantiles"]["95 %"]["value"]
    known = np.quantile(x[:, :2], 0.95, method="median_unbiased")
    assert quantile == pytest.approx(known)
    indices = found["responses"]["gap"]["indices"]
    assert indices["groups"] == 1000 and indices["broken"] == 0
    known = sobol_indices(x, drawn_trials(run).group_surface)
    for part, index in zip(("part_1", "part_2"), known, strict=False):
        total = indices["total"][part]
        assert total["value"] == index.total.value == pytest.approx(0.5, abs=1e-9)
        assert total["upper"] - total["lower"] < 1e-9  # the response is linear
    assert indices["total"]["angle"]["value"] == 0.0

    # chance may estimate more than all of each of the two kinds
    more = Indices(Estimate(1.2, 1.1, 1.3), Estimate(1.1, 0.9, 1.4))
    monkeypatch.setattr(indices_module, "sobol_indices", lambda *_: [more] * 3)
    found = contributing.indices_of(drawn_trials(run), "gap")
    assert found.first["angle"] == at_most_all(more.first)
    assert found.first["angle"].value == 1 and not found.first["angle"].sure
    assert found.total["angle"] == Estimate(1.0, 0.9, 1.0)


@pytest.mark.parametrize("sampling", ["latin", "sobol"])
def test_dependent_trials_have_replicate_intervals(toy, toy_study, sampling):
    text = toy_study.read_text().replace("trials = 1000", "trials = 1024")
    toy_study.write_text(
        f'sampling = "{sampling}"\n' + text.replace("+-1 mm", "+-.5 mm")
    )
    found = said(tolstat.run(toy_study, model=toy))["responses"]["gap"]
    median = found["quantiles"]["50 %"]
    assert median["lower"] < 0 < median["upper"]  # from replicates
    for each in (
        found["contributions"]["first_order"]["part_1"],
        found["contributions"]["rank_regression"]["part_1"],
    ):
        assert each["lower"] is None and each["reason"] == "for random trials only"


def test_groups_with_a_failed_trial_are_omitted_and_counted(toy, toy_study):
    text = toy_study.read_text().replace("trials = 1000", "trials = 5000")
    toy_study.write_text('sampling = "saltelli"\n' + text)
    run = tolstat.run(toy_study, model=toy)
    indices = said(run)["responses"]["gap"]["indices"]
    broken = np.any(run.status.reshape(-1, 5) != 1, axis=1).sum()
    assert indices["broken"] == broken > 0
    assert indices["groups"] == 1000 - broken


def test_runs_without_a_report_are_refused(tmp_path, toy, toy_study, mill):
    grid = tmp_path / "grid.toml"
    grid.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm", "1 mm"]\n'
    )
    with pytest.raises(QuestionError, match="are no sample: no statistics"):
        report_of(tolstat.run(grid, model=toy))
    with pytest.raises(QuestionError, match="did you mean 'yaw'"):
        report_of(mill, ["jaw"])
    toy_study.write_text(toy_study.read_text().replace('"+-1 mm"', '"1..2 mm"'))
    none_done = report_of(tolstat.run(toy_study, model=toy)).trials
    assert none_done.done == 0 and none_done.failed == none_done.ran > 0


def test_no_share_exceeds_100_per_cent(toy, toy_study, monkeypatch):
    """Chance may estimate more; no answer says so, but of sums that overlap."""
    estimated = Estimate(1.2, 0.9, 1.5)

    def more(*args, **options):
        return {
            name: each._replace(
                first_order=dict.fromkeys(each.first_order, estimated),
                groups=dict.fromkeys(each.groups, estimated),
                together=dict.fromkeys(each.together, estimated),
                unexplained=estimated,
            )
            for name, each in contributions(*args, **options).items()
        }

    monkeypatch.setattr(contributing, "contributions", more)
    run = tolstat.run(toy_study, model=toy)
    shares = said(run)["responses"]["gap"]["contributions"]
    every = [shares["unexplained"], shares["explained"]]
    for kind in ("first_order", "groups", "together"):
        every += shares[kind].values()
    assert len(every) >= 5
    for each in every:
        assert not any((each[key] or 0) > 1 for key in ("value", "lower", "upper"))
    assert shares["unexplained"]["lower"] == 0.9
    assert at_most_all(Estimate(1.2, 1.1, 1.3)).value == 1
    assert not at_most_all(Estimate(1.2, 1.1, 1.3)).sure
    assert at_most_all(Estimate(0.4, -0.1, 0.9)) == Estimate(0.4, -0.1, 0.9)


CHAIN = """\
model = "dimension_chain"
trials = 500
seed = 5
settings.gap = "H - a"
[links]
H = { nominal = "2450 mm", tolerance = "+-0.2 mm" }
a = { nominal = "33.33 mm", tolerance = "+-0.1 mm" }
[limits]
gap = "2416.42..2416.92 mm"
"""


def test_small_differences_of_large_values_are_printed(tmp_path):
    """A gap of 2.4 m that differs by tenths of millimetres; on screen and page."""
    path = tmp_path / "chain.toml"
    path.write_text(CHAIN)
    run = tolstat.run(path)
    trial = int(run.column("gap").argmax())
    largest = f"{1e3 * run.column('gap')[trial]:.4f}"
    call = partial(CliRunner().invoke, main)
    shown = call(["show", str(run.path)]).output
    assert "worst_max 2416.97 mm" in shown and "worst_min 2416.37 mm" in shown
    (value,) = re.findall(
        r"gap +(\S+) mm", call(["trial", str(run.path), str(trial)]).output
    )
    assert value == f"{float(largest):.{len(value) - 5}f}" and len(value) >= 8
    nominal = call(["trial", str(path), "--nominal"]).output
    assert "2416.67 mm" in nominal
    assert f">{value}</span>" in tolstat.report(run).html()
    # a limit of one's own has places of its own
    page = tmp_path / "own.html"
    call(["report", str(run.path), "--limit", "gap <= 2416.60012 mm", "-o", str(page)])
    nominal = re.search(r"nominal (2416.67) mm", page.read_text())
    assert nominal.group(1) == "2416.67"


def test_csv_says_why_a_number_has_no_interval(toy, toy_study):
    answer = tolstat.summary(tolstat.run(toy_study, model=toy, trials=100))
    (row, *_) = csv.DictReader(io.StringIO(answer.csv()))
    far = answer.responses[row["response"]].quantiles[0.99865]
    assert row["99.865 % lower [unit]"] == "" and far.reason.startswith("needs ")
    assert row["99.865 % reason"] == far.reason and row["mean reason"] == ""
    assert not any("reason" in name for name in answer.frame())
