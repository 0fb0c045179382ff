"""Comparison of plans: of a run with its study, and with this computer.

A plan is compared as a mapping of names to values, of those that matter.
"""

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.catalogue import place_of
from tolstat.deviations.draw import SAMPLERS
from tolstat.errors import (
    Advice,
    DataError,
    QuestionError,
    Remedy,
    RunFileError,
    StudyError,
    TolstatError,
)
from tolstat.execution.run_loop import other_results
from tolstat.execution.stages import rows_of
from tolstat.model.checked import simulate
from tolstat.model.contract import Model, TrialResults
from tolstat.status import Status
from tolstat.store.integrity import ranges_of
from tolstat.store.provenance import decisive, provenance
from tolstat.store.run_records import Plan, differences
from tolstat.store.stored_run import Run
from tolstat.study.files import study_text
from tolstat.study.sampling import Rule, rule_stored
from tolstat.study.study import Study, load
from tolstat.toml import toml_table

TRIED = 1, 1, 8, 8, 64, 64  # trials that show how long they take: the quickest count
LONGEST_TRY = 0.25  # s, that some of them may take


def study_of(
    run: Run, trials: int | Rule | None = None, model: Model | None = None
) -> Study:
    """Return the study of a run, read from its stored text; trials as of `load`."""
    sampled = None if run.listed else run.sampled
    if trials is None:
        fixed = run.complete or not run.rules
        trials = run.trials if fixed else rule_stored(run.rules)
    study = load(
        run.study.table,
        model=model,
        trials=trials if sampled else None,
        seed=sampled.seed if sampled else None,
        folder=run.data_folder,
        longest_trial=run.isolation.longest_trial if run.isolation else None,
    )
    if study.until and study.until.budget:
        study = replace(study, trials=max(study.trials, run.trials))
    return replace(study, thinned=run.random_trials if run.thinned else 0)


def seconds_per_trial(run: Run, study: Study | None) -> float:
    """Return the time of a trial, s: that of the run, or of some evaluated again.

    The run took the compilation, the audit, and what else the machine did. Trials of a
    model that moves are not evaluated again, nor without a study.
    """
    seconds = float(run.times.get("seconds", np.inf)) / max(run.ended, 1)
    done = np.flatnonzero(run.status == Status.DONE)[: TRIED[-1]]
    if study is None or study.model.integrates or not len(done):
        return seconds
    stored = {contributor.name for contributor in run.contributors}
    names = [contributor.name for contributor in study.description.contributors]
    if {*names} != stored:  # its data have changed
        return seconds
    deviations = np.column_stack([run.column(name)[done] for name in names])
    with suppress(TolstatError):  # a model that fails says so where it is needed
        for number in TRIED:
            rows = deviations[:number]
            if len(rows) * seconds > LONGEST_TRY:
                break
            began = time.perf_counter()
            simulate(study.model, rows, study.settings)
            seconds = min(seconds, (time.perf_counter() - began) / len(rows))
    return seconds


def study_differs(run: Run, study_file: Path | None = None) -> list[str]:
    """Return the changes of the study file since a run was made from it.

    The run may be a stranger's. So a file that it names is quoted only if it is a study
    of its model, and has the name of the run beside it; of any other one, what the run
    stores.
    """
    path = study_file or run.study_file
    try:
        table = toml_table(study_text(path)) if path else run.study.table
    except (DataError, ValueError, RecursionError):
        return []  # moved, or being edited: the run stores its text
    changes = list(differences(run.study.table, table))
    ours = not path or path.with_suffix(".h5") == run.path.resolve()
    if study_file or (ours and table.get("model") == run.model):
        return [
            f"{path}: {name} was {old!r} when the run was made, and is {new!r}"
            for name, old, new in changes
        ]
    stored = [
        f"{path}: {name} was {old!r} when the run was made, and differs"
        for name, old, _ in changes
        if old is not None
    ]
    return stored or ([f"{path} differs from the study of the run"] if changes else [])


def edits_since(run: Run) -> list[str]:
    """Return sentences on how the study beside a run was edited since."""
    study = run.study_file
    if not study or study.with_suffix(".h5") != run.path.resolve():
        return []
    return [f"{change}; answers are of the run" for change in study_differs(run)]


def made_differently(run: Plan, source_digest: str) -> list[str]:
    """Return reasons why a trial evaluated here may differ in its bits.

    They are source (of the model as it is now), processor, compiler and versions;
    empty if there are none. An older run does not know its machine code.
    """
    stored, current = decisive(run.made), decisive(provenance())
    reasons = [
        f"the run was made with {fact} {old}, and this is {current[fact]}"
        for fact, old in stored.items()
        if old != current[fact]
    ]
    if run.source_digest != source_digest:
        source = (
            f"the run was made by tolstat {run.made['version_tolstat']} of another "
            f"source ({run.source_digest}, not {source_digest})"
        )
        reasons.insert(0, source)
    return reasons


def is_other_source(run: Run, study: Study) -> bool:
    """Tell whether a custom model has another source than that of the run."""
    return bool(run.machine) and study.model.source_digest != run.source_digest


def check_source(run: Run, study: Study) -> None:
    """Refuse to evaluate trials beside those of a custom model of another source.

    Raises
    ------
    QuestionError
        If the source of the model has changed since the run, or is that of another one.
    """
    if is_other_source(run, study):
        raise QuestionError(
            f"{run.path}: its model '{run.model}' had another source "
            f"({run.source_digest[:12]}) than here ({study.model.source_digest[:12]}): "
            "its trials and new ones are of two models",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def check_same(run: Run, plan: Plan, sampled: Mapping[str, NDArray[Any]]) -> None:
    """Refuse to resume a run if its study now samples other trials.

    `plan` and the columns `sampled` are those of the study as it is now.
    """
    changes = [
        f"{name}: {old}, now {new}"
        for name, old, new in differences(_compared(run), _compared(plan))
    ]
    if not changes:
        other = trials_sampled_differently(run, sampled)
        healthy = np.setdiff1d(other[run.status[other] > 0], run.damage.trials)
        if len(healthy):
            changes.append(
                f"the deviations of trials {ranges_of(healthy)} differ from those that "
                f"the study samples now: {why_sampled_differently(run)}"
            )
    if changes:
        raise RunFileError(
            f"{run.path} cannot be resumed: {'; '.join(changes)}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def _compared(plan: Plan) -> dict[str, Any]:
    """Return what two plans of the same run share, beside the deviations."""
    reference = plan.reference.columns if plan.reference else {}
    tables: dict[str, Mapping[Any, Any]] = {
        "column": plan.units,
        **plan.entries,
        "status": plan.words,
        "points of the reference,": {n: p.tolist() for n, p in reference.items()},
    }
    return {f"{kind} {key}": v for kind, t in tables.items() for key, v in t.items()}


def why_sampled_differently(run: Run) -> str:
    """Return why a study may sample other trials than those of its run."""
    if not (run.aim or run.thinned):
        return "its data or number of trials differ"
    how = "searched for rare trials" if run.aim else "thinned trials"
    return (
        "its data or number of trials differ, or the run was made by a tolstat "
        f"{run.made['version_tolstat']} that {how} differently "
        f"(here: {version('tolstat')})"
    )


def trials_sampled_differently(
    run: Run, columns: Mapping[str, NDArray[Any]]
) -> NDArray[np.int64]:
    """Return the trials of a run whose deviations differ from columns sampled again.

    Stages are left out that were not sampled yet, or cannot be sampled again because
    answers are missing.
    """
    differ, sampled = np.zeros(run.trials, bool), np.ones(run.trials, bool)
    names = [name for name in run.input_names if name in columns]
    for contributor in run.contributors:
        if contributor.name in names:
            sampled &= ~np.isnan(columns[contributor.name][: run.trials])
            missing = np.isnan(run.column(contributor.name))
            sampled &= (run.status != Status.NOT_RUN) | ~missing
    for name in names:
        stored, new = run.column(name), columns[name][: run.trials]
        if new.dtype.kind == "f":  # bit for bit
            stored, new = (
                np.ascontiguousarray(x).view(np.uint64) for x in (stored, new)
            )
        differ |= stored != new
    return np.flatnonzero(differ & sampled)


def check_rows(run: Run, study: Study, trials: int | Rule | None) -> None:
    """Refuse a run whose rows of a file differ now, or are not `trials`."""
    if not (study.points and study.points.places):
        return
    note, rows = study.points.note, len(study.points.deviations)
    if isinstance(trials, int) and trials != rows:
        raise RunFileError(
            f"{run.path} cannot be extended to {trials} trials: it runs all rows of "
            f"its file, {note}"
        )
    known = study.answers
    if rows < run.trials:
        raise RunFileError(
            f"{run.path} has {run.trials} trials, and its file fewer: {note}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )
    ended = np.flatnonzero(run.status != Status.NOT_RUN)
    ended = np.setdiff1d(ended, run.damage.trials)
    if known and len(other := rows_differing(run, known, ended)):
        raise RunFileError(
            f"{run.path}: the responses of trials {ranges_of(other)} differ from those "
            f"of the file now: {note}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, run=run),
        )


def rows_differing(
    run: Run, known: TrialResults, trials: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return which trials have other answers in a file now."""
    trials = trials[trials < len(known.status)]
    return trials[other_results(rows_of(known, trials), run.results(trials))]


def file_read_again(run: Run, study: Study) -> str:
    """Return in words whether the file of rows is as it was; empty without one."""
    if not (study.points and study.points.places):
        return ""
    same = study.points.note in run.notes
    return "as stored" if same else f"another file: {study.points.note}"


def check_extensible(run: Run, trials: int | Rule) -> None:
    """Refuse an extension that would not keep the stored trials; or see its rule."""
    if run.listed and not (run.sampling == "table" and isinstance(trials, int)):
        raise RunFileError(
            f'{run.path} cannot be extended: sampling = "{run.sampling}" runs exactly '
            "the trials of the study"
        )
    if run.rules and not run.complete:
        ran = run.progress.replace(" of ", " of at most ")
        raise RunFileError(
            f"{run.path} is not complete: {ran} trials have run; finish it first",
            Advice(Remedy.RESUME, run.path, run.machine),
        )
    if not isinstance(trials, int):
        return
    if run.thinned:
        raise RunFileError(
            f"{run.path} cannot be extended: the trials after number "
            f"{run.random_trials - 1} were thinned",
            Advice(Remedy.DECIDE, run.path, run.machine),
        )
    if trials <= run.trials:
        raise RunFileError(
            f"{run.path} has {run.trials} trials already; give a larger number"
        )
    if not run.listed and not SAMPLERS[run.sampling].extensible:
        raise StudyError(
            f'{run.path} cannot be extended: with sampling = "{run.sampling}" every '
            f"trial depends on the number of trials, and would change with {trials}",
            Advice(Remedy.RUN_AGAIN, run.path, run.machine, trials, run),
        )


def check_asked(run: Run, study: Study) -> None:
    """Refuse a run of another study, of another seed, or of fewer trials."""
    changes, machine = study_differs(run, study.path), place_of(study.model)
    advice = []
    sampled = None if run.listed else run.sampled
    if run.listed and run.trials != study.trials:
        changes.append(f"trials: the run has {run.trials}, the study {study.trials}")
    if sampled and sampled.seed != study.seed:
        changes.append(f"seed: the run has {sampled.seed}, the study {study.seed}")
    if sampled and study.until and not run.rules:
        changes.append(
            f"trials: the run has {run.trials} without a stopping rule; the study runs "
            f"until {', '.join(study.until.rules)}"
        )
    elif sampled and not run.rules and run.trials < study.trials:
        if not changes and SAMPLERS[run.sampling].extensible:
            advice.append(Advice(Remedy.EXTEND, run.path, machine, study.trials))
        changes.append(f"trials: the run has {run.trials}, the study {study.trials}")
    if changes:
        assert study.path
        raise RunFileError(
            f"{run.path} is a run of another study: {'; '.join(changes)}; it is kept",
            *advice,
            Advice(Remedy.REPLACE_RUN, study.path, machine),
        )
