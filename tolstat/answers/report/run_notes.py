"""What must be known to read the numbers of a run: failures first."""

from __future__ import annotations

import math

import numpy as np

from tolstat.model.description import StudyNumber
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.run_records import Audited
from tolstat.store.stored_run import Run
from tolstat.units.scale import PER_CENT


def notes_of(run: Run, sample: Sample | None) -> list[str]:
    """Say what must be known to read the numbers of a run.

    Parameters
    ----------
    run : Run
        Complete or not.
    sample : Sample or None
        The trials that its statistics rest on; None where they were not sampled.
    """
    notes = []
    if run.ended and not run.aim:  # trials of a search fail more often than production
        notes.append(_failed(run, sample))
    if run.rerun:
        notes.append(_rerun(run, run.rerun))
    if run.ended < run.trials:
        left = run.trials - run.ended
        notes.append(f"{left} of {run.trials} trials have not run")
    nominal = run.nominal_values["status"]
    if nominal != Status.DONE.word:
        notes.append(f"the nominal trial: {nominal}")
    notes += run.notes
    own = [_in_words(run, number) for number in run.numbers if number.of]
    if own:
        notes.append("from tolerances alone: " + ", ".join(own))
    if run.stopped:
        reached = "reached" if run.stopped.reached else "not reached"
        stages = ", ".join(map(str, run.stopped.stages))
        rules = "; ".join(run.stopped.rules)
        text = f"{rules}: {reached}, checked after {stages} trials"
        if math.isfinite(wanted := run.stopped.wanted) and wanted:
            text += f"; about {wanted:.0f} would be needed"
        notes.append(text)
    return notes


def _failed(run: Run, sample: Sample | None) -> str:
    text = f"{run.failed} of {run.ended} trials failed"
    if sample and len(sample.status) < run.trials:
        ran = int(np.count_nonzero(sample.ran))
        text += f", {sample.failed} of the {ran} that statistics rest on"
    if sample and (share := sample.failures).sure:
        _, lower, upper = PER_CENT.interval(*share[:3])
        text += f" (95 % interval {lower} to {upper} %)"
    if said := ", ".join(f"{count} {word}" for word, count in run.failures.items()):
        text += f": {said}; they count as out of every limit"
    return text


def _rerun(run: Run, rerun: Audited) -> str:
    """Say how failed trials ended when they were evaluated again."""
    settings = ", ".join(f"{key} = {value:g}" for key, value in rerun.settings.items())
    codes, counts = np.unique(rerun.status, return_counts=True)
    pairs = zip(codes.tolist(), counts, strict=True)
    ended = ", ".join(f"{count} {run.words[code]}" for code, count in pairs)
    return (
        f"{len(rerun.trials)} failed trials evaluated again with {settings}: {ended}; "
        "they still count as failed"
    )


def _in_words(run: Run, number: StudyNumber) -> str:
    """Write a number of the study, and what it does not say."""
    value = run.scale_of(number).words(number.value)
    if math.isnan(number.value):
        value = "none"
    caveat = f" ({number.caveat})" if number.caveat else ""
    return f"{number.name} {value}{caveat}"
