"""Scenarios of cheap models: the same trials, evaluated with other deviations."""

from dataclasses import replace
from pathlib import Path

from tolstat.answers.what_if.fresh_study import edited
from tolstat.execution.compatibility import seconds_per_trial
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store.stored_run import Run
from tolstat.study.editor import StudyChange
from tolstat.study.study import Study, load

THINNED = (
    "the run thinned its trials; the baseline was evaluated again with random ones, "
    "those of the scenario: its verdicts and fractions may differ from the report of "
    "the run"
)
TRIALS, PATIENCE = 20_000, 10.0  # trials in so many seconds, or as the run took


def is_cheap(run: Run, study: Study) -> bool:
    """Tell whether a scenario is evaluated rather than estimated from stored trials."""
    if run.aim or run.listed or not run.ended:
        return False
    limit = max(PATIENCE, float(run.times["seconds"]))
    return TRIALS * seconds_per_trial(run, study) <= limit


def scenario_run(run: Run, study: Study, change: StudyChange) -> Run:
    """Return the run of a scenario, in memory, with the seed and trials of the run."""
    assert run.sampled is not None
    editor = study.editor()
    if change != StudyChange():
        editor = edited(run, study, change).editor
    editor.table |= {"seed": run.sampled.seed, "trials": run.trials}
    folder = run.data_folder or Path()
    scenario = load(editor.table, model=study.model, folder=folder)
    with Workers(None) as workers:
        return execute(scenario, None, workers)


def baseline_run(run: Run, study: Study) -> Run:
    """Return the same trials of a thinned run as a scenario has, none left out.

    Chance chose the evaluated ones, so those of a scenario are others.
    """
    again = scenario_run(run, study, StudyChange())
    return replace(again, path=run.path, notes=(*again.notes, THINNED))
