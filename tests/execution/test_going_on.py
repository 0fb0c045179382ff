"""Resumed runs equal uninterrupted runs bit for bit."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass

import h5py
import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tests.execution.same_runs import Enough, same
from tests.store.tampering import resealed
from tolstat.answers.report.full_report import report_of
from tolstat.errors import ModelError, Remedy, RunFileError, StoppedError, StudyError
from tolstat.execution.execute import execute, go_on
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.study.study import load

HEAD = """\
model = "toy"
trials = 1000
seed = 1
"""
DEVIATING = """\
[deviations]
part = "+-1 mm"
angle = { tolerance = "0..360 deg", distribution = "uniform" }
[limits]
gap = "-1..2 mm"
"""
GRID = """\
model = "toy"
sampling = "grid"
[grid]
part_1 = { from = "0 mm", to = "1 mm", points = 200 }
mode = ["plain", "odd"]
[limits]
gap = "<= 1 mm"
"""
UNTIL = 'trials = { until = "gap p95 +-3 %", at_most = 20000 }'


def of(sampling):
    return f'sampling = "{sampling}"\n{HEAD}{DEVIATING}'


STUDIES = {
    "random": HEAD + DEVIATING,
    "sobol": of("sobol"),
    "latin": of("latin"),
    "saltelli": of("saltelli"),
    "grid": GRID,
    "until": HEAD.replace("trials = 1000", UNTIL) + DEVIATING,
    "decide": HEAD.replace("1000", '"decide"') + DEVIATING,
}


def written(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text(text)
    return path


def stopped(study, path, trials):
    enough = Enough(trials)
    with Workers(2, enough, block=20) as crew:
        asked = load(study, model=Toy())
        return execute(asked, path, crew, progress=enough.tell)


@pytest.mark.parametrize("sampling", STUDIES)
def test_a_resumed_run_equals_an_uninterrupted_run(tmp_path, sampling):
    study = written(tmp_path, STUDIES[sampling])
    whole = tolstat.run(study, model=Toy(), output=tmp_path / "whole.h5")
    path = tmp_path / "part.h5"
    for trials in (0, 200) if sampling in ("random", "grid") else (200,):
        path.unlink(missing_ok=True)
        part = stopped(study, path, trials)
        assert not part.complete and trials <= part.ended < whole.trials
        assert part.provenance["trials_done"] == np.count_nonzero(part.status == 1)
        assert same(tolstat.resume(path, model=Toy()), whole)
    assert tolstat.resume(path, model=Toy()).complete


@pytest.mark.parametrize("trials", [0, 200])
def test_a_partial_run_has_a_report(tmp_path, trials):
    """Its numbers as JSON, too: no time is missing."""
    path = tmp_path / "part.h5"
    part = stopped(written(tmp_path, STUDIES["random"]), path, trials)
    assert part.provenance["ended_at"] >= part.provenance["started_at"]
    if trials:
        found = json.loads(report_of(part).json())
        assert found["provenance"]["trials_done"] == part.counts["done"]
        assert found["provenance"]["seconds"] > 0
        tolstat.report(part)
        tolstat.compare(part, part)
    assert f"{part.trials - part.ended} of 1000 trials have not run" in " ".join(
        tolstat.summary(part).trials.notes
    )


def test_a_run_is_stopped_again_and_again(tmp_path):
    study = written(tmp_path, STUDIES["until"])
    whole = tolstat.run(study, model=Toy(), output=tmp_path / "whole.h5")
    path = tmp_path / "part.h5"
    part, spent, times = stopped(study, path, 5), 0.0, 0
    while not part.complete:
        assert part.provenance["seconds"] > spent
        spent, times = part.provenance["seconds"], times + 1
        enough = Enough(part.ended + 1200)
        with Workers(2, enough, block=150) as crew:
            part = go_on(path, crew, model=Toy(), progress=enough.tell)
    assert times > 2 and same(part, whole)


@pytest.mark.parametrize(
    ("sampling", "trials"), [("random", 200), ("sobol", 100_000), ("until", 100_000)]
)
def test_an_extended_run_equals_one_run(tmp_path, sampling, trials):
    study = written(tmp_path, STUDIES[sampling])
    path = tmp_path / "part.h5"
    part = stopped(study, path, trials)
    wanted = part.trials + 700
    whole = tolstat.run(study, model=Toy(), trials=wanted, output=tmp_path / "whole.h5")
    assert same(tolstat.extend(path, wanted, model=Toy()), whole)
    with pytest.raises(RunFileError, match=f"has {wanted} trials already; give"):
        tolstat.extend(path, wanted, model=Toy())


@pytest.mark.parametrize(
    ("sampling", "words"),
    [("latin", "depends on the number of trials"), ("grid", "runs exactly the trials")],
)
def test_a_refusal_to_extend_has_a_reason(tmp_path, sampling, words):
    study = written(tmp_path, STUDIES[sampling])
    run = tolstat.run(study, model=Toy())
    before = run.path.read_bytes()
    with pytest.raises((RunFileError, StudyError), match=words):
        tolstat.extend(run.path, 5000, model=Toy())
    assert run.path.read_bytes() == before


def damage(path):
    with h5py.File(path, "r+") as file:
        file["gap"][17] *= 2
        file["part_1"][40] = 0.5e-3
        file["status"][41] = 2
        file["status"][42] = 0
        file["nominal/gap"][...] = 1.0
        file["checks/clock"][...] = 7.0


def test_damage_is_found_and_repaired(tmp_path):
    study = written(tmp_path, STUDIES["until"])
    run = tolstat.run(study, model=Toy())
    assert tolstat.verify(run.path, model=Toy()).whole
    damage(run.path)
    found = tolstat.verify(run.path, model=Toy())
    assert found.trials.tolist() == [17, 40, 41, 42]
    assert found.drawn_otherwise.tolist() == [40] and found.run.damage.clock
    assert found.nominal_differs and not found.whole
    assert same(tolstat.resume(run.path, model=Toy()), run)
    assert tolstat.verify(run.path, model=Toy(), every=True).whole


def test_rows_with_a_valid_checksum_are_evaluated_again(tmp_path):
    """A forgery, or a processor that erred."""
    run = tolstat.run(written(tmp_path, STUDIES["random"]), model=Toy())
    with resealed(run.path) as file:
        file["gap"][17] *= 2
        file["status"][18] = 4
        file["part_1"][40] = 0.5e-3
    found = tolstat.verify(run.path, model=Toy(), every=True)
    assert not found.run.damage and found.contradicting.tolist() == [18]
    assert found.drawn_otherwise.tolist() == [40]
    assert found.different.tolist() == [17, 18]
    with pytest.raises(RunFileError, match="deviations of trials 40 differ from those"):
        tolstat.resume(run.path, model=Toy())


def test_the_rule_of_an_until_run_is_kept(tmp_path):
    text = STUDIES["until"]
    run = tolstat.run(written(tmp_path, text), model=Toy())
    assert run.rules
    again = tolstat.resume(run.path, model=Toy(), regardless=True)
    with resealed(run.path) as file:
        file.attrs["source_digest"] = "0123"
    again = tolstat.resume(run.path, model=Toy(), regardless=True)
    assert again.rules == run.rules and again.stopped == run.stopped
    assert "resumed at" in again.notes[-1]


def test_other_sources_and_processors_are_named(tmp_path):
    study = written(tmp_path, STUDIES["random"])
    whole = tolstat.run(study, model=Toy(), output=tmp_path / "whole.h5")
    path = tmp_path / "part.h5"
    stopped(study, path, 200)
    with resealed(path) as file:
        file.attrs["source_digest"] = "0123"
        file["provenance"].attrs["processor"] = "abacus"
        file["provenance"].attrs["version_numba"] = "0.1"
        file["provenance"].attrs["machine_code"] = "for an abacus"
    with pytest.raises(RunFileError) as refused:
        tolstat.resume(path, model=Toy())
    for words in ("(0123, not", "processor abacus", "numba 0.1", "code for an"):
        assert words in str(refused.value)
    assert Remedy.RESUME_REGARDLESS in [each.remedy for each in refused.value.advice]
    run = tolstat.resume(path, model=Toy(), regardless=True)
    assert run.frame().equals(whole.frame())
    assert "another source (0123, not" in run.notes[-1]


def test_a_run_that_does_not_know_its_machine_code_is_resumed(tmp_path):
    study, path = written(tmp_path, STUDIES["random"]), tmp_path / "part.h5"
    stopped(study, path, 200)
    with resealed(path) as file:
        del file["provenance"].attrs["machine_code"]
    assert tolstat.resume(path, model=Toy()).complete


def test_a_study_that_was_changed_is_named(tmp_path):
    study = written(tmp_path, STUDIES["random"])
    whole = tolstat.run(study, model=Toy(), output=tmp_path / "whole.h5")
    path = tmp_path / "part.h5"
    stopped(study, path, 200)
    study.write_text(study.read_text().replace("-1..2 mm", "-1..3 mm"))
    with pytest.raises(RunFileError, match=r"limits\.gap was '-1\.\.2 mm' when"):
        tolstat.resume(path, model=Toy())
    again = tolstat.resume(path, model=Toy(), regardless=True)
    assert "limits.gap was '-1..2 mm'" in again.notes[-1]
    assert same(again, whole, but="notes")


@dataclass(frozen=True)
class Wider(Toy):
    def describe(self, settings):
        found = super().describe(settings)
        return found._replace(responses=found.responses[:1])


def test_a_model_with_other_columns_is_refused(tmp_path):
    run = tolstat.run(written(tmp_path, STUDIES["random"]), model=Toy())
    for regardless in (False, True):
        with pytest.raises(RunFileError, match="column ratio: 1, now None"):
            tolstat.resume(run.path, model=Wider(), regardless=regardless)


def test_changed_data_of_a_study_are_detected(tmp_path):
    parts = tmp_path / "parts.csv"
    parts.write_text("length [mm]\n" + "".join(f"{0.01 * i}\n" for i in range(40)))
    text = HEAD + "[deviations]\n"
    text += 'part_1 = { data = "parts.csv", column = "length", nominal = "0.2 mm" }\n'
    study = written(tmp_path, text)
    path = tmp_path / "elsewhere" / "part.h5"
    stopped(study, path, 200)
    moved = tmp_path / "moved"
    moved.mkdir()
    for each in ("study.toml", "parts.csv", "elsewhere"):
        shutil.move(tmp_path / each, moved / each)
    path, parts = moved / "elsewhere" / "part.h5", moved / "parts.csv"
    parts.write_text(parts.read_text().replace("0.3\n", "0.31\n"))
    with pytest.raises(
        RunFileError, match=r"deviations of trials .* differ from those"
    ):
        tolstat.resume(path, model=Toy())
    parts.write_text(parts.read_text().replace("0.31\n", "0.3\n", 1))
    assert tolstat.resume(path, model=Toy()).complete


def test_repeated_failed_trials_are_kept_separately(tmp_path):
    """What failed still counts as failed; what came of it then stands beside it."""
    study = written(
        tmp_path,
        'model = "stand"\ntrials = 12\nseed = 5\n[deviations]\nrod_length = "+-1 mm"\n',
    )
    run = tolstat.run(study)
    before = run.frame()
    with resealed(run.path) as file:
        file["status"][[3, 7]] = 2
        for response in run.responses:
            file[response.name][[3, 7]] = np.nan
    again = tolstat.resume(run.path, rerun_failed=True)
    assert again.counts["too many steps"] == 2 and again.failed == 2
    assert again.rerun.trials.tolist() == [3, 7] and (again.rerun.status == 1).all()
    assert again.rerun.settings == pytest.approx({"rtol": 1e-6, "max_step": 2.5e-4})
    precise, known = again.rerun.responses["rod_force_1"], before["rod_force_1"][[3, 7]]
    assert np.all(precise != known) and np.allclose(precise, known, rtol=1e-2)
    assert repr(again.diagnostics) == repr(run.diagnostics)
    with pytest.raises(ModelError, match="no tighter settings"):
        failing = tolstat.run(
            written(tmp_path, STUDIES["random"]), model=Toy(), output=tmp_path / "t.h5"
        )
        tolstat.resume(failing.path, model=Toy(), rerun_failed=True)


def test_a_run_put_back_is_not_shown_as_the_new_one(toy, tmp_path):
    """Stopped before any trial was over, with force."""
    study = written(tmp_path, STUDIES["random"])
    before = tolstat.run(study, model=toy)
    asked = load(study, model=toy, seed=2)
    with (
        Workers(1, lambda: True) as crew,
        pytest.raises(StoppedError, match="unchanged"),
    ):
        execute(asked, before.path, crew, force=True)
    assert tolstat.open(before.path).sampled.seed == 1
    assert StoppedError.exit_code == 130
