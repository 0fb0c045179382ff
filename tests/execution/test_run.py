"""A run from the study file to the frame, the same for any workers and blocks."""

from __future__ import annotations

import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.conftest import mill_text
from tolstat.errors import ModelError, QuestionError, RunFileError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import BlockSize, Workers
from tolstat.model.checked import simulate
from tolstat.render.screen import show
from tolstat.status import Status
from tolstat.study.given_points import Case
from tolstat.study.study import load


def test_a_toy_from_study_to_frame(toy, toy_study):
    run = tolstat.run(toy_study, model=toy, workers=2)
    frame = run.frame()
    assert run.path == toy_study.with_suffix(".h5")
    assert frame.shape == (1000, 6)
    assert list(frame.columns) == [
        "part_1",
        "part_2",
        "angle",
        "gap",
        "ratio",
        "status",
    ]
    done = frame["status"] == "done"
    np.testing.assert_array_equal(done, frame["part_1"] <= 0.9e-3)
    assert 0 < (~done).sum() < 20
    np.testing.assert_allclose(
        frame["gap"][done], 2 * (frame["part_1"] + frame["part_2"])[done]
    )
    assert frame.loc[~done, ["gap", "ratio"]].isna().all(axis=None)
    assert run.counts["not finite"] == (~done).sum()
    assert run.nominal["gap"] == 0.0 and run.nominal["status"] == "done"
    assert run.limits["gap"].permitted == pytest.approx((-1e-3, 2e-3))
    assert run.limits["gap"].words == "-1..2 mm"
    assert run.study.table["trials"] == 1000 and run.study.text == toy_study.read_text()
    assert frame.attrs["units"]["angle"] == "rad" and frame.index.name == "trial"


def test_an_existing_run_is_not_overwritten(toy, toy_study):
    first = tolstat.run(toy_study, model=toy, trials=10)
    before = first.path.read_bytes()
    with pytest.raises(RunFileError, match="replaced only by force"):
        tolstat.run(toy_study, model=toy, trials=20)
    assert first.path.read_bytes() == before
    assert tolstat.run(toy_study, model=toy, trials=20, force=True).trials == 20


def test_a_folder_that_cannot_be_written(toy, toy_study, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFileError, match="cannot be written"):
        tolstat.run(toy_study, model=toy, output=tmp_path / "file" / "run.h5")


def test_seed_and_trials_of_the_caller(toy, toy_study, tmp_path):
    one = tolstat.run(toy_study, model=toy, trials=50, seed=5, output=tmp_path / "a.h5")
    two = tolstat.run(toy_study, model=toy, trials=80, seed=5, output=tmp_path / "b.h5")
    np.testing.assert_array_equal(one.column("part_1"), two.column("part_1")[:50])
    assert one.sampled.seed == 5


@pytest.fixture(scope="module")
def khpt75(tmp_path_factory):
    """75 machines of khpt75, five of them impossible, and their outcome."""
    path = tmp_path_factory.mktemp("mill") / "khpt75.toml"
    path.write_text(mill_text())
    study = load(path)
    names = [contributor.name for contributor in study.description.contributors]
    deviations = study.deviations()[:75]
    deviations[[3, 4, 40, 70, 74], names.index("rod_stiffness_1")] = -2.0
    return study, deviations, simulate(study.model, deviations, study.settings)


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("block", [1, 7, 64, 1000])
def test_bitwise_the_same_for_any_workers_and_blocks(khpt75, workers, block):
    study, deviations, whole = khpt75
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    found = np.full((len(deviations), whole.responses.shape[1]), -1.0)
    status, steps = np.zeros(len(deviations), int), np.zeros(len(deviations), int)
    cases = (Case(0, len(deviations), study.settings),)
    with Workers(workers, block=block) as crew:
        for blocks in crew.blocks(study.model, cases, deviations):
            for first, outcome in blocks:
                rows = slice(first, first + len(outcome.status))
                found[rows], status[rows] = outcome.responses, outcome.status
                steps[rows] = outcome.steps
    np.testing.assert_array_equal(found, whole.responses)
    np.testing.assert_array_equal(status, whole.status)
    np.testing.assert_array_equal(steps, whole.steps)
    assert np.count_nonzero(status != Status.DONE) == 5
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_bitwise_the_same_in_other_processes(khpt75):
    """A block is a pure function of what is sent: any executor will do."""
    study, deviations, whole = khpt75
    context = multiprocessing.get_context("spawn")
    with (
        ProcessPoolExecutor(2, mp_context=context) as others,
        Workers(2, executor=others, block=20) as crew,
    ):
        found = crew.simulate(study.model, deviations, study.settings)
    np.testing.assert_array_equal(found.responses, whole.responses)
    np.testing.assert_array_equal(found.steps, whole.steps)


def test_bitwise_the_same_among_shuffled_neighbours(khpt75):
    study, deviations, whole = khpt75
    order = np.random.default_rng(11).permutation(75)
    shuffled = simulate(study.model, deviations[order], study.settings)
    np.testing.assert_array_equal(shuffled.responses, whole.responses[order])
    np.testing.assert_array_equal(shuffled.steps, whole.steps[order])


def test_every_machine_of_khpt75_accounts_for_its_energy(khpt75):
    study, _, whole = khpt75
    names = [response.name for response in study.description.responses]
    residual = whole.responses[:, names.index("energy_residual")]
    assert np.nanmax(np.abs(residual)) < 1e-5


def test_a_stored_trial_is_the_evaluated_one(small_study):
    run = tolstat.run(small_study, workers=2)
    frame = run.frame()
    names = [contributor.name for contributor in run.contributors]
    again = tolstat.evaluate("stand", frame[names])
    for name in again.columns.drop("status"):
        np.testing.assert_array_equal(frame[name], again[name], err_msg=name)
    nominal = tolstat.evaluate("stand").iloc[0]
    assert run.nominal["rod_force_1"] == nominal["rod_force_1"]


def test_the_paired_study_has_the_same_parts(tmp_path):
    runs = [
        tolstat.run(f"runs/{name}.toml", trials=16, output=tmp_path / f"{name}.h5")
        for name in ("khpt75", "khpt75-equalized")
    ]
    for contributor in runs[0].contributors:
        columns = [run.column(contributor.name) for run in runs]
        np.testing.assert_array_equal(*columns)
    assert np.all(runs[1].column("guide_energy") == 0)


def test_errors_on_a_worker_are_raised(toy, toy_study):
    class Broken(type(toy)):
        def evaluate(self, deviations, settings):
            if len(deviations) > 1:
                raise ZeroDivisionError("broken model")
            return super().evaluate(deviations, settings)

    with pytest.raises(ModelError, match=r"toy.*ZeroDivisionError: broken model") as e:
        tolstat.run(toy_study, model=Broken())
    assert "(test_run.py, line" in str(e.value)
    assert isinstance(e.value.__cause__, ZeroDivisionError)
    assert not toy_study.with_suffix(".h5").exists()  # nothing has run


def test_every_trial_is_in_one_block(toy):
    n, seen = 20_000, np.zeros(20_000, int)
    settings = toy.settings()
    with Workers(2) as crew:
        cases = [Case(0, 7777, settings), Case(7777, 7778, settings)]
        cases.append(Case(7778, n, settings))
        for some in crew.blocks(toy, cases, np.zeros((n, 3))):
            for first, outcome in some:
                seen[first : first + len(outcome.responses)] += 1
    assert np.all(seen == 1)


def test_blocks_grow_until_they_last_half_a_second():
    """Seconds are handed over: no clock."""
    size, left = BlockSize(2, None), 10_000_000
    sizes = [size.next(left)]
    while sizes[-1] < 500_000 and len(sizes) < 20:
        size.learn(sizes[-1], sizes[-1] * 1e-6)  # a microsecond a trial
        sizes.append(size.next(left))
    assert sizes[0] == 32 and sizes[-1] == 500_000 and len(sizes) < 8
    size.learn(500_000, 500_000 * 0.02)  # the machine has become slow
    assert size.next(left) == 25
    size.learn(25, 100.0)
    assert size.next(left) == 8
    assert BlockSize(2, None).next(64) == 32
    # towards the end blocks are short again, so that no worker waits for the other
    quick = BlockSize(2, None)
    quick.learn(1_000_000, 0.5)
    assert quick.next(1000) == 250


def test_a_grid_without_any_trial_says_so(toy, tmp_path, capsys):
    study = load(
        {"model": "toy", "sampling": "grid", "limits": {"gap": "<= 2 mm"},
         "grid": {"part_1": {"from": "0 mm", "to": "1 mm", "points": 5}}},
        model=toy,
    )  # fmt: skip
    run = execute(study, tmp_path / "r.h5", Workers(1, lambda: True))
    show(tolstat.summary(run).document())
    said = capsys.readouterr().out
    assert run.ended == 0 and "No trial has run." in said
    assert "tolstat resume" in said and "failed" not in said and "gap" not in said


@pytest.mark.parametrize("sampling", ["random", "sobol"])
def test_a_part_of_a_run_counts_what_its_statistics_rest_on(sampling, toy, tmp_path):
    study = load(
        {"model": "toy", "trials": 512, "seed": 1, "sampling": sampling,
         "deviations": {"part": "+-1 mm"}, "limits": {"gap": "<= 2 mm"}},
        model=toy,
    )  # fmt: skip
    run = execute(study, tmp_path / "r.h5", Workers(1))
    status = np.where(np.arange(512) % 7 == 2, 0, run.status)
    part = replace(run, columns={**run.columns, "status": status}, complete=False)
    trials = json.loads(tolstat.summary(part).json())["trials"]
    assert trials["requested"] == 512 and trials["failed"] > 0
    assert trials["counted"] == trials["done"] + trials["failed"] == part.ended
    assert "that statistics rest on" not in tolstat.summary(part).html()


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin", "saltelli"])
def test_a_run_without_any_trial_says_so(sampling, toy, tmp_path, capsys):
    """Killed before its first block is stored: every question has a sentence."""
    study = load(
        {"model": "toy", "trials": 64, "seed": 1, "sampling": sampling,
         "deviations": {"part": "+-0.1 mm"}, "limits": {"gap": "<= 2 mm"}},
        model=toy,
    )  # fmt: skip
    run = execute(study, tmp_path / "r.h5", Workers(1))
    status = np.zeros_like(run.status)
    empty = replace(run, columns={**run.columns, "status": status}, complete=False)
    found = tolstat.summary(empty)
    show(found.document())
    said = capsys.readouterr().out
    assert "No trial has run." in said and "tolstat resume" in said
    for word in ("gap", "Quantiles", "not run", "no trial is done", "0 trials"):
        assert word not in said
    assert json.loads(found.json())["trials"]["counted"] == 0
    for question in (
        lambda: tolstat.report(empty),
        lambda: tolstat.what_if(empty, {"part": "+-0.05 mm"}, model=toy),
    ):
        with pytest.raises(QuestionError, match="no trial has run"):
            question()


@pytest.mark.parametrize("first", [0, 5])  # missing, failed
@pytest.mark.parametrize("trials", [slice(0, 32), slice(0, 255), slice(1, 256)])
def test_any_part_of_a_run_has_answers(toy, tmp_path, first, trials):
    """Also where its first block is slow, or fails, and where one trial is left."""
    study = load(
        {"model": "toy", "trials": 256, "seed": 1,
         "deviations": {"part": "+-0.2 mm"}, "limits": {"gap": "<= 0.5 mm"}},
        model=toy,
    )  # fmt: skip
    run = execute(study, tmp_path / "r.h5", Workers(1))
    columns = {name: values.copy() for name, values in run.columns.items()}
    columns["status"][trials] = first
    for each in run.responses:
        columns[each.name][trials] = np.nan
    part = replace(run, columns=columns, complete=False, audited=None)
    report, over = tolstat.report(part), np.count_nonzero(columns["status"])
    found = json.loads(report.json())
    assert found["trials"]["counted"] == over == part.ended
    assert found["trials"]["failures"]["value"] == part.failed / over
    gaps = columns["gap"][columns["status"] == Status.DONE]
    assert found["responses"]["gap"]["mean"]["value"] == pytest.approx(gaps.mean())
    assert f"{part.ended}" in report.html() and report.csv()
