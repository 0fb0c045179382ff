"""What-if without a run: against fresh runs, and refusals outside the sample."""

from __future__ import annotations

import io
import json
import re
import shlex
import tomllib
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
import tomli_w
from click.testing import CliRunner
from scipy.stats import norm

import tolstat
from tests.conftest import TOY_STUDY, Toy
from tests.studies.benchmarks.what_if import CASES, compared
from tolstat.cli.main import main
from tolstat.deviations.names import expand
from tolstat.errors import QuestionError, RunFileError, StudyError

what_if = partial(tolstat.what_if, evaluate=False)  # of stored trials alone
QUICK = ("narrower, another", "shifted", "all alike, narrower")


def test_what_if_agrees_with_fresh_runs(tmp_path):
    cases = [c for c in CASES if c.words in QUICK and c.machine in ("stack", "batch")]
    assert len(cases) == len(QUICK)
    for case, effective, answers in compared(cases, tmp_path, 2000, 4):
        assert 500 < effective < 1500, case
        told = [each for each in answers if each.holds is not None]
        assert len(told) >= 7
        assert all(each.holds for each in told), case
        # and it says another thing than the run as it is
        assert any(
            each.as_run.lower > each.fresh.upper or each.fresh.lower > each.as_run.upper
            for each in told
        )


@pytest.fixture(scope="module")
def toy():
    return Toy()


@pytest.fixture(scope="module")
def run(toy, tmp_path_factory):
    path = tmp_path_factory.mktemp("toy") / "toy.toml"
    path.write_text(TOY_STUDY)
    return tolstat.run(path, model=toy)


def test_common_scenarios_report_all_numbers(run, toy):
    asked = {"part_1": {"tolerance": "+-1 mm", "cp": 1.5}, "part_2": "-0.9..+0.7 mm"}
    found = what_if(run, asked, model=toy, limits={"gap": "-1..1.5 mm"})
    changed = found.changes
    assert list(changed) == ["part_1", "part_2"]
    assert changed["part_1"].baseline == "normal, +-1 mm, cp 1"
    assert changed["part_1"].scenario == "normal, +-1 mm, cp 1.5"
    before, gap = found.responses["gap"].baseline, found.responses["gap"].scenario
    # twice the sum of two normal parts
    mean, sigma = -0.2e-3, 2e-3 * np.hypot(1 / 4.5, 0.8 / 3)
    assert gap.mean.lower < mean < gap.mean.upper
    assert gap.sigma.lower < sigma < gap.sigma.upper
    assert gap.quantiles[0.95].lower < mean + 1.645 * sigma < gap.quantiles[0.95].upper
    assert gap.limited.limit.words == "-1..1.5 mm"
    assert before.limited.limit == gap.limited.limit
    assert before.sigma.value > gap.sigma.value
    assert np.isnan(gap.largest) and gap.limited.yields.needed == 0
    assert 400 < found.effective_sample_size < 1000
    assert any(
        "requested limits, not those of the study" in note for note in found.notes
    )


def test_out_of_limit_trials_have_their_own_effective_sample_size(run, toy):
    """Of a normal sum whose part moves by its sigma: Kish's ratio in closed form.

    E[w] over a set is its share after the shift; E[w^2] is e times that after twice the
    shift.
    """
    sigma, own = 2e-3 * np.sqrt(2) / 3, 2e-3 / 3  # of the gap, of a part in it
    part = {"part_1": "-1.3333333333..0.6666666667 mm"}
    few = what_if(run, part, model=toy, limits={"gap": ">= -1.5 mm"})
    many = what_if(run, part, model=toy, limits={"gap": "<= 0 mm"})
    for found, out in ((few, lambda at: norm.cdf(-1.5e-3, at, sigma)),
                       (many, lambda at: norm.sf(0.0, at, sigma))):  # fmt: skip
        expected = found.trials * out(-own) ** 2 / (np.e * out(-2 * own))
        size = found.responses["gap"].out_of_limit_sample_size
        assert size == pytest.approx(expected, rel=0.5), expected
        said = "decide these fractions" in str(found.document())
        assert said == (size < 100)
        assert found.effective_sample_size <= found.expected_sample_size
    assert found.expected_sample_size == pytest.approx(found.trials / np.e, rel=0.02)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"part": "+-1.5 mm"}, "tails are too heavy for the sampled ones"),
        ({"part": "+-3 mm"}, "of these parts lie outside the sampled range"),
        ({"angle": {"tolerance": "0..400 deg", "distribution": "uniform"}},
         r"10 % of these parts lie outside the .*; sampled: uniform, 0\.\.360"),
        ({"part_1": "2.5..3 mm"}, "tails are too heavy|lie outside the sampled range"),
        ({"part": "+-0.2 mm"}, r"effective sample size \d+ of 1000 trials; 150 needed"),
        ({"part": {"distribution": "constant", "value": "0 mm"}}, "nearly the same"),
        ({"parts": "+-1 mm"}, "did you mean 'part'"),
        ({"part": "+-1 kN"}, "of another kind"),
        ({"part": {"tolerance": "+-1 mm", "common": True}}, "leave out common"),
        ({}, "no entry is given"),
    ],
)  # fmt: skip
def test_scenarios_outside_the_sample_are_refused_with_a_reason(run, toy, asked, said):
    with pytest.raises(StudyError, match=said):
        what_if(run, asked, model=toy)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ({"part": 5}, r"\[deviations\] part = 5: expected a (tolerance|limit) such as"),
        ({"part": None}, r"\[deviations\] part: expected a (tolerance|limit) such as"),
        ({1: "+-1 mm"}, r"\[deviations\] 1: a text is expected as the name"),
        ([("part", "+-1 mm")], r"deviations.*: expected a (limit|mapping)"),
    ],
)
def test_wrong_python_arguments_are_refused_with_a_message(run, toy, lines, said):
    with pytest.raises(StudyError, match=said):
        what_if(run, lines, model=toy)
    with pytest.raises(StudyError, match=said.replace("deviations", "limits")):
        tolstat.limited(run, lines, toy)


def test_measured_parts_are_read_next_to_the_study(toy, toy_study, monkeypatch):
    parts = np.random.default_rng(7).normal(0, 0.2, 60)
    table = "\n".join(["off [mm]", *(f"{part:.4f}" for part in parts)])
    folder = toy_study.parent / "study"
    folder.mkdir()
    study, elsewhere = toy_study.rename(folder / "toy.toml"), toy_study.parent
    (folder / "parts.csv").write_text(table)
    run = tolstat.run(study, model=toy)
    monkeypatch.chdir(elsewhere)
    (elsewhere / "parts.csv").write_text(table.replace("0.", "100."))
    line = {"data": "parts.csv", "column": "off", "fit": "normal"}
    stored = tolstat.open(run.path)
    found = what_if(stored, {"part_1": line}, model=toy)
    assert found.changes["part_1"].fraction_left > 0.3
    for outside in ("../parts.csv", str(elsewhere / "parts.csv")):
        with pytest.raises(StudyError, match="outside the folder of the study"):
            what_if(stored, {"part_1": {**line, "data": outside}}, model=toy)


def chain_of(folder, *, limit="-3..0 mm", demanded="99.73 %", **more):
    """Two links of distributions that have ends, and two of one name."""
    kinds = {"distribution": "uniform"}, {"distribution": "triangular", "mode": "0 mm"}
    links = {
        name: {"nominal": "20 mm", "tolerance": "+-0.2 mm", **kind}
        for name, kind in zip("HA", kinds, strict=True)
    }
    pair = {f"d_{i}": {"nominal": "1 mm", "tolerance": "+-0.1 mm"} for i in (1, 2)}
    study = {
        "model": "dimension_chain", "trials": 2000, "seed": 5,
        "links": links | pair, "settings": {"gap": "H - A - d_1 - d_2"},
        "limits": {"gap": {"limit": limit, "yield": demanded}},
    }  # fmt: skip
    path = folder / "chain.toml"
    path.write_text(tomli_w.dumps(study))
    return tolstat.run(path, **more)


def refusal(run, asked, **more):
    with pytest.raises(StudyError) as refused:
        what_if(run, asked, **more)
    return str(refused.value)


def fresh_run(run, asked, **more):
    """Run the study of the fresh run, beside that of the run."""
    path = run.study_file.with_name("fresh.toml")
    limits, model = more.get("limits"), more.get("model")
    path.write_text(tolstat.fresh_study(run, asked, limits=limits, model=model))
    return tolstat.run(path, model=model, force=True)


def entries(run, asked, **more):
    return tomllib.loads(tolstat.fresh_study(run, asked, **more))["deviations"]


def test_a_refusal_of_a_valid_scenario_names_the_command_to_run(tmp_path):
    run = chain_of(tmp_path, trials=1500, seed=8)
    wide = ["H=+-0.4 mm", 'd={ tolerance = "+-0.3 mm", cp = 1.1 }']
    refused = CliRunner().invoke(main, ["what-if", str(run.path), *wide, "--reweight"])
    (typed,) = re.findall("`tolstat (.*)` writes the study", refused.output)
    path = tmp_path / "chain.what-if.toml"
    assert refused.exit_code == 2 and shlex.split(typed)[-1] == str(path)
    written = CliRunner().invoke(main, shlex.split(typed))
    assert written.exit_code == 0 and "tolstat run" in written.output
    _, typed = written.output.strip().split("tolstat ")
    made = CliRunner().invoke(main, shlex.split(typed))
    assert made.exit_code == 0, made.output
    # it goes on until all is decided, with a seed of its own; it replaces nothing
    own = tolstat.open(path.with_suffix(".h5"))
    assert own.trials >= 1024 and own.sampled.seed == 9 and run.path.exists()
    assert {name: each.words for name, each in own.assumed.items()} == {
        "H": "uniform, +-0.4 mm",
        "A": run.assumed["A"].words,
        "d_1": "normal, +-0.3 mm, cp 1.1",
        "d_2": "normal, +-0.3 mm, cp 1.1",
    }
    refused = CliRunner().invoke(main, ["what-if", str(run.path), *wide, "--reweight"])
    assert "chain.what-if-2.toml" in refused.output


def test_a_fresh_run_has_trials_that_are_likely_to_decide(tmp_path, monkeypatch):
    """Where 10 % may be out of limit: by the stored trials, ten times these at most."""
    monkeypatch.setattr("tolstat.answers.what_if.fresh_study.QUICK", 0.0)
    asked = {"H": {"tolerance": "+-0.19 mm", "distribution": "uniform"}}
    for trials, expected in ((300, 3000), (600, 4200), (4000, 4000)):
        run = chain_of(tmp_path, trials=trials, limit="-2.22..0 mm", demanded="90 %")
        gap = what_if(run, asked).responses["gap"].scenario
        assert 0.06 < gap.limited.yields.fraction_out_of_limit.value < 0.08
        fresh = fresh_run(run, asked)
        assert fresh.trials == expected
        judged = tolstat.summary(fresh).responses["gap"].limited.yields
        assert judged.verdict == "met"
        run.path.unlink()


def test_a_fresh_run_is_larger_where_few_trials_tell_of_it(tmp_path, monkeypatch):
    """About 1 of 1700 effective trials is out of limit: 4000 would not decide."""
    links = {"A": "60 +-0.1 mm", "B": "25.05 +-0.2 mm", "C": "34.7 +-0.15 mm"}
    study = {
        "model": "dimension_chain", "trials": 4000, "seed": 14, "links": links,
        "gaps": {"gap": "A - B - C"}, "limits": {"gap": "0.05..0.55 mm"},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "bought.h5")
    asked = {"C": "-0.144..0.044 mm"}
    seen = what_if(run, asked).responses["gap"].scenario.limited.yields
    assert seen.verdict == "undecided"
    quick = "tolstat.answers.what_if.fresh_study.QUICK"
    monkeypatch.setattr(quick, 1.0)
    assert 'trials = "decide"' in tolstat.fresh_study(run, asked)
    monkeypatch.setattr(quick, 0.0)
    assert tomllib.loads(tolstat.fresh_study(run, asked))["trials"] > 10_000
    small = {"C": "+-0.14 mm"}  # surely not met
    assert "trials = 4000" in tolstat.fresh_study(run, small)


def test_an_inline_table_is_read_as_the_command_line_reads_it(tmp_path):
    run = chain_of(tmp_path)
    text, table = '{ nominal = "20.02 mm" }', {"nominal": "20.02 mm"}
    made = tolstat.fresh_study(run, {"H": text})
    assert made == tolstat.fresh_study(run, {"H": table})
    assert tomllib.loads(made)["links"]["H"]["nominal"] == "20.02 mm"
    with pytest.raises(StudyError, match="H"):
        tolstat.fresh_study(run, {"H": "{ nominal = "})
    text, table = '{ tolerance = "+-0.09 mm", cp = 1.1 }', {
        "tolerance": "+-0.09 mm", "cp": 1.1,
    }  # fmt: skip
    found = [what_if(run, {"H": entry}).changes["H"] for entry in (text, table)]
    assert found[0] == found[1]


def test_the_study_of_another_size_goes_on_until_all_is_decided(tmp_path):
    run = chain_of(tmp_path, trials=4000, limit="-2.22..0 mm", demanded="90 %")
    asked = {"H": {"nominal": "20.02 mm"}}
    assert 'trials = "decide"' in tolstat.fresh_study(run, asked)


def test_failures_are_reported_for_the_run_only(run, toy):
    """Of the stored trials, as they are: the interval too."""
    found = what_if(run, {"part": "+-0.5 mm"}, model=toy)
    failed = tolstat.summary(run).trials.notes[0]
    assert "trials failed (95 % interval" in failed and failed in found.notes


def test_a_written_study_is_valid_and_replaces_no_file(tmp_path):
    run = chain_of(tmp_path)

    def write(*options):
        asked = ["what-if", str(run.path), "H=+-0.1 mm", "--write", *map(str, options)]
        return CliRunner().invoke(main, asked)

    assert write(tmp_path / "new.toml").exit_code == 0
    for options, said in (
        ([tmp_path / "new.toml"], "exists and is not replaced"),
        ([tmp_path / "new.txt"], "the name of a study ends in .toml"),
        ([tmp_path / "no" / "new.toml"], "no such folder"),
        ([tmp_path / "other.toml", "--json"], "--write takes no -o, --json or --csv"),
    ):
        refused = write(*options)
        assert refused.exit_code == 2 and said in refused.output


def test_a_study_is_written_only_next_to_its_data(toy, toy_study):
    folder = toy_study.parent
    (folder / "parts.csv").write_text("off [mm]\n" + "0.1\n0.2\n0.3\n" * 20)
    line = '{ data = "parts.csv", column = "off", fit = "normal" }'
    toy_study.write_text(
        toy_study.read_text().replace("part = ", f"part_1 = {line}\n#")
    )
    run = tolstat.run(toy_study, model=toy)
    asked = {"angle": "+-4 rad"}
    assert entries(run, asked, model=toy)["part_1"]["data"] == "parts.csv"
    other = folder / "other"
    other.mkdir()
    with pytest.raises(
        StudyError, match=r"other samples these deviations(.|\n)*parts.csv"
    ):
        tolstat.fresh_study(run, asked, model=toy, folder=other)
    (other / "parts.csv").write_text("off [mm]\n" + "0.1\n0.2\n0.4\n" * 20)
    with pytest.raises(
        StudyError, match=r"other samples these.* data of that name differ there"
    ):
        tolstat.fresh_study(run, asked, model=toy, folder=other)


def test_measured_parts_without_a_fit_are_those_of_the_run(toy, toy_study):
    (toy_study.parent / "parts.csv").write_text("off [mm]\n" + "0.1\n0.2\n0.3\n" * 20)
    line = 'part_1 = { data = "parts.csv", column = "off" }'
    toy_study.write_text(toy_study.read_text().replace("part = ", f"{line}\n#"))
    run = tolstat.run(toy_study, model=toy)
    assert entries(run, {"angle": "+-4 rad"}, model=toy)["part_1"]["column"] == "off"


def test_an_entry_of_several_parts_is_kept_for_the_others(toy, toy_study):
    """One of two parts that share an entry."""
    run = tolstat.run(toy_study, model=toy)
    angle = {"tolerance": "0..360 deg", "distribution": "uniform"}
    assert entries(run, {"part_1": "+-2 mm"}, model=toy) == {
        "part_1": "+-2 mm", "part_2": "+-1 mm", "angle": angle,
    }  # fmt: skip


TOP = 'model = "toy"\ntrials = 1000\nseed = 1\n'
STYLES = {
    "lines": """\
[deviations]
part = "+-1 mm"
angle = { tolerance = "0..360 deg", distribution = "uniform" }
[limits]
gap = { limit = "-1..2 mm", yield = "90 %" }
""",
    "tables": """\
[deviations.part]
tolerance = "+-1 mm"
[deviations.angle]
tolerance = "0..360 deg"
distribution = "uniform"
[limits.gap]
limit = "-1..2 mm"
yield = "90 %"
""",
    "dots": """\
deviations.part = "+-1 mm"
deviations.angle.tolerance = "0..360 deg"
deviations.angle.distribution = "uniform"
limits.gap.limit = "-1..2 mm"
limits.gap.yield = "90 %"
""",
}


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    "asked", [{"angle": "+-4 rad"}, {"part_1": "+-2 mm"}, {"part": "+-2 mm"}]
)
def test_the_written_study_is_right_for_any_notation(toy, tmp_path, style, asked):
    """With the requested limits, of which as much is demanded."""
    study = tmp_path / "toy.toml"
    study.write_text(TOP + STYLES[style])
    run = tolstat.run(study, model=toy)
    limits = {"gap": "-1..1.5 mm"}
    refusal(run, asked, model=toy, limits=limits)
    own = fresh_run(run, asked, model=toy, limits=limits)
    assert own.limits["gap"].words == "-1..1.5 mm" and own.limits["gap"].demanded == 0.9
    known = [each.name for each in run.contributors]
    new = {each: line for name, line in asked.items() for each in expand(name, known)}
    for name, before in run.assumed.items():
        words = before.words
        if name in new:
            kind = "uniform, {}" if name == "angle" else "normal, {}, cp 1"
            words = kind.format(new[name])
        assert own.assumed[name].words == words


def test_a_limit_is_added_to_a_response_without_one(run, toy):
    asked, limits = {"part": "+-2 mm"}, {"ratio": "<= 0.5"}
    refusal(run, asked, model=toy, limits=limits)
    text = tolstat.fresh_study(run, asked, model=toy, limits=limits)
    assert tomllib.loads(text)["limits"] == {"gap": "-1..2 mm", "ratio": "<= 0.5"}


@pytest.mark.parametrize("common", ["true", "0.4"])
def test_a_scenario_of_some_parts_of_a_batch_has_no_fresh_run(toy, toy_study, common):
    """A batch is one line: what is said instead leads to a run."""
    both = f'{{ tolerance = "+-1 mm", common = {common} }}'
    toy_study.write_text(toy_study.read_text().replace('"+-1 mm"', both))
    run = tolstat.run(toy_study, model=toy)
    with pytest.raises(StudyError) as refused:
        tolstat.fresh_study(run, {"part_1": "+-2 mm", "angle": "+-4 rad"}, model=toy)
    words = str(refused.value)
    assert "part_1: a batch is one entry" in words and "`part = ...`" in words
    kept = {"tolerance": "+-2 mm", "common": tomllib.loads(f"x = {common}")["x"]}
    assert entries(run, {"part": "+-2 mm"}, model=toy)["part"] == kept


def test_a_scenario_that_no_study_can_hold_has_no_fresh_run(toy, toy_study):
    """Correlated parts deviate."""
    close = "[correlation]\npart_1 = { part_2 = 0.5 }\n[limits]"
    toy_study.write_text(toy_study.read_text().replace("[limits]", close))
    run = tolstat.run(toy_study, model=toy)
    none = {"distribution": "constant", "value": "0 mm"}
    refusal(run, {"part_1": none}, model=toy)
    with pytest.raises(StudyError, match=r"no study in .* samples these"):
        tolstat.fresh_study(run, {"part_1": none}, model=toy)


def test_the_fresh_study_is_that_of_the_run(tmp_path, monkeypatch):
    """Where its file is another by now, or none, the run has it."""
    monkeypatch.setattr("tolstat.answers.what_if.fresh_study.QUICK", 1.0)
    run = chain_of(tmp_path)
    study = tmp_path / "chain.toml"
    text = study.read_text()
    study.write_text(text.replace("+-0.1 mm", "+-0.3 mm"))
    busy = replace(run, times={**run.times, "seconds": 400.0})  # by other work
    for one in (run, busy):
        made = tomllib.loads(tolstat.fresh_study(one, {"H": "+-0.4 mm"}))
        before = tomllib.loads(text)
        before["links"]["H"]["tolerance"] = "+-0.4 mm"
        before |= {"seed": before["seed"] + 1, "trials": "decide"}
        assert made == before
        study.unlink(missing_ok=True)


def test_a_refusal_of_a_wrong_scenario_offers_no_run(stack):
    for wrong in ("parts=+-2 mm", "part=+-1 kN"):
        refused = stack("what-if", wrong)
        assert refused.exit_code == 2 and "--write" not in refused.output
    refused = stack("what-if", "part=+-2 mm")
    assert refused.exit_code == 2 and "--write" in refused.output


def test_a_refusal_names_every_contributor(tmp_path):
    run = chain_of(tmp_path)
    words = refusal(run, {"H": "+-0.4 mm", "A": "+-0.5 mm", "d_1": "+-0.3 mm"})
    assert all(f"[deviations] {name} = " in words for name in ("H", "A", "d_1"))
    narrow = {"tolerance": "+-0.1 mm", "distribution": "uniform"}
    words = refusal(run, {"H": narrow, "A": "+-0.03 mm", "d": "+-0.01 mm"})
    assert all(f"{name} alone" in words for name in ("H", "A", "d_1", "d_2"))


def test_a_change_of_some_correlated_parts_is_refused(toy, toy_study):
    close = "[correlation]\npart_1 = { part_2 = 0.9 }\n[limits]"
    toy_study.write_text(toy_study.read_text().replace("[limits]", close))
    run = tolstat.run(toy_study, model=toy)
    with pytest.raises(StudyError, match="parts that are correlated: part_2 too"):
        what_if(run, {"part_1": "+-0.5 mm"}, model=toy)
    both = what_if(run, {"part": "+-0.5 mm"}, model=toy)
    assert both.effective_sample_size > 350


def test_dependent_trials_are_refused(toy, toy_study):
    text = toy_study.read_text().replace("1000", "1024")
    toy_study.write_text('sampling = "latin"\n' + text)
    run = tolstat.run(toy_study, model=toy)
    asked = {"part": "+-0.5 mm"}
    with pytest.raises(QuestionError, match="latin trials depend on each"):
        what_if(run, asked, model=toy)
    own = fresh_run(run, asked, model=toy)
    assert own.sampling == "random" and own.trials >= 1024  # that can decide
    what_if(own, {"part": "+-0.4 mm"}, model=toy)


def test_a_run_whose_data_have_changed_is_refused(toy, toy_study):
    """Data, or a model: what the file holds of the distributions tells."""
    parts = toy_study.with_name("parts.csv")
    sizes = np.linspace(-0.4, 0.4, 60)
    parts.write_text("\n".join(["part [mm]", *map(str, sizes)]))
    text = toy_study.read_text()
    entry = 'part_1 = { data = "parts.csv", column = "part" }'
    text = text.replace("[deviations]\n", f"[deviations]\n{entry}\n")
    toy_study.write_text(text.replace("\npart = ", "\npart_2 = "))
    run = tolstat.run(toy_study, model=toy)
    what_if(run, {"part_2": "+-0.5 mm"}, model=toy)
    sizes[30] += 1e-3
    parts.write_text("\n".join(["part [mm]", *map(str, sizes)]))
    with pytest.raises(RunFileError, match="samples other deviations now"):
        what_if(run, {"part_2": "+-0.5 mm"}, model=toy)


def test_requested_limits_replace_those_of_the_study(run, toy):
    again = tolstat.limited(run, {"gap": "-1..1.2 mm", "ratio": "<= 0.5"}, toy)
    assert run.limits["gap"].words == "-1..2 mm"
    assert list(again.limits) == ["gap", "ratio"]
    bad = (run.column("gap") > 1.2e-3) | (run.column("gap") < -1e-3) | (run.status > 1)
    np.testing.assert_array_equal(again.beyond("gap"), bad)
    worst = again.worst_trials("ratio")
    done = np.where(run.status == 1, run.column("ratio"), -np.inf)
    assert list(worst) == np.argsort(-done)[:10].tolist()
    halved = again.diagnostics.halved["gap"]["part_1", "part_2"].beyond
    assert halved.value < run.diagnostics.halved["gap"]["part_1", "part_2"].beyond.upper
    assert halved.sure and not run.diagnostics.halved.get("ratio")
    notes = tolstat.summary(again).trials.notes
    said = "requested limits, not those of the study: gap -1..1.2 mm; ratio <= 0.5"
    assert any(note.startswith(said) for note in notes)
    # the demanded yield stays where nothing else is said
    less = tolstat.limited(run, {"gap": {"limit": "-1..2 mm", "yield": "90 %"}}, toy)
    assert less.limits["gap"].demanded == 0.9
    assert tolstat.limited(less, {"gap": "-1..1 mm"}).limits["gap"].demanded == 0.9
    # as typed, for a limit with as many ends
    few = tolstat.limited(run, {"gap": {"limit": "-1..2 mm", "ppm": 2000}}, toy)
    assert tolstat.limited(few, {"gap": "-1..1 mm"}).limits["gap"].demand == "2000 ppm"
    good = tolstat.limited(run, {"gap": {"limit": "-1..2 mm", "ppk": 1.33}}, toy)
    assert tolstat.limited(good, {"gap": "-1..1 mm"}).limits["gap"].ppk == 1.33
    other = tolstat.limited(good, {"gap": "<= 1 mm"}).limits["gap"]
    assert (other.demand, other.demanded) == ("", good.limits["gap"].demanded)
    assert (
        tolstat.limited(run, {"gap": "-1000..900 um"}, toy).scales["gap"].shown == "um"
    )


@pytest.fixture(scope="module")
def stack(tmp_path_factory):
    path = tmp_path_factory.mktemp("stack") / "stack.h5"
    place = "runs/own/stack.py:Stack"
    made = CliRunner().invoke(
        main, ["run", "runs/own/stack.toml", "--machine", place, "--trials", "1000",
               "-o", str(path)],
    )  # fmt: skip
    assert made.exit_code == 0, made.output

    def ask(command, *arguments):
        asked = [command, str(path), *arguments, "--machine", place]
        asked += ["--reweight"] * (command == "what-if")
        return CliRunner().invoke(main, asked)

    return ask


def test_both_verdicts_fit_in_80_columns(stack, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, as far as rich can tell
    monkeypatch.setenv("COLUMNS", "80")
    shown = stack("what-if", "part=+-0.025 mm", "--limit", "gap <= 0.18 mm")
    text = re.sub(r"\x1b\[[\d;]*m", "", shown.output)
    heads = r"response +limit +verdict +out of limit, ppm +equivalent Ppk +\n"
    assert re.search(heads, text), text


def test_the_command_line_prints_and_writes(stack):
    shown = stack("what-if", "part=+-0.025 mm", "--limit", "gap <= 0.18 mm")
    assert shown.exit_code == 0, shown.output
    assert "out of limit, ppm" in shown.output and "<= 0.18 mm" in shown.output
    assert "Nothing was simulated" in shown.output
    assert "for a single look" in shown.output
    table = 'part_1={ tolerance = "+-0.03 mm", cp = 1.3 }'
    found = json.loads(stack("what-if", table, "--json").output)
    assert found["changes"]["part_1"]["scenario"].endswith("cp 1.3")
    limited = found["responses"]["gap"]["scenario"]["limited"]
    assert (
        limited["yields"]["fraction_out_of_limit"]["lower"]
        < limited["yields"]["fraction_out_of_limit"]["upper"]
    )
    assert "baseline" in found["responses"]["gap"]
    table = pd.read_csv(io.StringIO(stack("what-if", table, "--csv").output))
    assert list(table["response"]) == list(found["responses"])
    assert (table["effective sample size"] == found["effective_sample_size"]).all()
    row, gap = table.set_index("response").loc["gap"], found["responses"]["gap"]
    assert row["unit"] == "mm" and "part_1: normal" in row["scenario"]
    sides = gap["scenario"], gap["baseline"]
    beyond, before = (of["limited"]["yields"]["fraction_out_of_limit"] for of in sides)
    for head, told, times in (
        ("mean lower [unit]", gap["scenario"]["mean"]["lower"], 1e3),
        ("baseline: 5 % [unit]", gap["baseline"]["quantiles"]["5 %"]["value"], 1e3),
        ("fraction out of limit upper [ppm]", beyond["upper"], 1e6),
        ("baseline: fraction out of limit upper [ppm]", before["upper"], 1e6),
    ):
        assert row[head] == pytest.approx(times * told, rel=1e-9), head
    again = json.loads(stack("report", "--json", "--limit", "gap >= 0 mm").output)
    assert again["responses"]["gap"]["limited"]["limit"]["words"] == ">= 0 mm"


def test_a_tolerance_alone_keeps_the_distribution(tmp_path):
    """A table is the entry as a whole."""
    run = chain_of(tmp_path)
    for name, words in (("H", "uniform, {}"), ("A", "triangular, {}, mode 0 mm")):
        found = what_if(run, {name: "+-0.1 mm"})
        assert found.changes[name].scenario == words.format("+-0.1 mm")
        shown = CliRunner().invoke(main, ["what-if", str(run.path), f"{name}=+-0.1 mm"])
        assert shown.exit_code == 0 and words.format("+-0.1 mm") in shown.stdout
        entry = {"tolerance": "+-0.1 mm"}
        whole = what_if(run, {name: entry}).changes[name]
        assert whole.scenario == "normal, +-0.1 mm, cp 1"
        fresh = tomllib.loads(tolstat.fresh_study(run, {name: entry}))
        assert fresh["links"][name] == {"nominal": "20 mm", **entry}


def test_the_page_of_the_command_line(stack, tmp_path):
    page = tmp_path / "page.html"
    asked = ("part=+-0.025 mm", "--limit", "gap <= 0.18 mm", "-o", str(page))
    made = stack("what-if", *asked)
    assert made.exit_code == 0, made.output
    text = page.read_text()
    assert (
        len(re.findall("<td[^>]*>scenario", text)) == 2 and "for a single look" in text
    )


def test_a_yield_of_zero_is_printed(stack):
    asked = ("part=+-0.025 mm", "--limit", "gap >= 9 mm", "--json")
    found = json.loads(stack("what-if", *asked).output)
    yields = found["responses"]["gap"]["scenario"]["limited"]["yields"]
    assert (
        yields["fraction_out_of_limit"]["value"] == 1 and yields["within"]["value"] == 0
    )
    assert (
        found["all_limits"]["scenario"]["within"]["value"] == 0
        and yields["verdict"] == "not met"
    )


def test_numbers_of_the_baseline_are_not_in_what_if(tmp_path):
    run = tolstat.run("runs/wave-gear.toml", trials=1000, output=tmp_path / "run.h5")
    own = "from tolerances alone: "
    assert any(own in note for note in tolstat.summary(run).trials.notes)
    line = {"tolerance": "+-0.012 mm", "distribution": "uniform"}
    found = what_if(run, {"R_out": line})
    assert not any(own in note for note in found.notes)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("what-if", "part"), "NAME=TOLERANCE"),
        (("what-if", "part=h8", "part=h9", "or", "part=h7"), "is given twice"),
        (("what-if", "part=h8", "or"), "between two scenarios"),
        (("what-if", "part={ tolerance"), "part={ tolerance"),
        (("what-if", "part=+-0.02 mm", "-o", "no/x.html"), "no such folder"),
        (("report", "--limit", "gap"), "such as"),
        (("report", "--limit", "0.5 mm >= gap"), '--limit "0.5 mm >= gap"'),
        (("report", "--limit", "gap <= 1 kN"), "gap"),
        (("report", "--limit", "gab <= 1 mm"), "did you mean 'gap'"),
        (("what-if", "part=+-0.045 mm"), "tails are too heavy"),
    ],
)
def test_errors_end_with_exit_code_2_and_a_message(stack, arguments, said):
    found = stack(*arguments)
    assert found.exit_code == 2 and said in found.output
    assert "Traceback" not in found.output
