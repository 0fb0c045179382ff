"""Fields of every answer about a run: notes, title block, provenance."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.answer import Answer
from tolstat.answers.next_steps import SAVED, typed_setting
from tolstat.errors import QuestionError, allowed_names
from tolstat.model.description import StudyNumber
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weights import RARE
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.run_records import Audited, Chosen, Stopped
from tolstat.store.stored_run import IN_MEMORY, Run
from tolstat.units.scale import PER_CENT, PPM, Scale, figures

UNITS = (("hours", 3600.0), ("minutes", 60.0))  # of predicted times
MOST_IN_FOCUS = 8  # responses, where no limit says which ones matter
MOST_OUTPUTS = 3  # of failed trials, in notes
NOT_DECIDED = "deciding was stopped, or goes on"
MOST_NUMBERS = 12  # from tolerances alone, in a note: the page has all


class TrialCounts(NamedTuple):
    """Counts of the trials, by how they ended."""

    requested: int
    ran: int
    done: int  # of those that the statistics rest on, as the two below
    failed: int
    counted: int
    by_status: Mapping[str, int]  # by the word of each status
    failures: Estimate  # fraction that failed
    unseen: float  # fraction of production that may lie outside all trials done
    sampling: str
    promise: str  # what the intervals hold for
    notes: tuple[str, ...]  # for readers of the numbers, failures first


class TitleBlock(NamedTuple):
    """The title block of the signature page; empty texts where not given."""

    project: str
    drawing: str
    revision: str
    author: str
    approval: str


class SampledDeviation(NamedTuple):
    """The assumed distribution of a deviation: words, tolerance, scale."""

    words: str
    lower: float
    upper: float
    scale: Scale
    sentence: str


class Assumptions(NamedTuple):
    """The assumptions behind the numbers."""

    deviations: Mapping[str, SampledDeviation]  # by contributor that deviates
    correlation: Mapping[str, Mapping[str, float]]  # of ranks, as the study has them
    settings: Mapping[str, Chosen]
    of_the_model: tuple[str, ...]
    missing: str  # why there are no slopes and worst cases; empty if there are


@dataclass(frozen=True, repr=False)
class AboutRun(Answer):
    """An answer about one run."""

    title: str
    run: str
    model: str
    title_block: TitleBlock
    provenance: Mapping[str, object]  # versions, times, processor, text of the study
    stored_run: Run = field(metadata={"json": False})


@dataclass(frozen=True, repr=False)
class RunAnswer(AboutRun):
    """An answer about a run whose trials are sampled."""

    trials: TrialCounts
    assumptions: Assumptions
    stopped: Stopped | None  # how a stopping rule ended it; None without one


def fields_of(run: Run, trials: TrialCounts) -> dict[str, Any]:
    """Return the fields of `RunAnswer`."""
    deviations = {
        part.name: SampledDeviation(
            assumed.words, *assumed.tolerance, run.scales[part.name], part.sentence
        )
        for part in run.contributors
        if (assumed := run.assumed.get(part.name))
    }
    return {
        **identity_of(run),
        "trials": trials,
        "assumptions": Assumptions(
            deviations, run.correlation, run.settings, run.assumptions,
            run.diagnostics.missing,
        ),
        "stopped": run.stopped,
    }  # fmt: skip


def identity_of(run: Run) -> dict[str, Any]:
    """Return the fields of an answer that say which run it is about."""
    seed = {"seed": run.sampled.seed} if run.sampled and not run.listed else {}
    return {
        "title": run.title,
        "run": run.path.name,
        "model": run.model,
        "title_block": TitleBlock(
            *(run.document.get(name, "") for name in TitleBlock._fields)
        ),
        "provenance": {
            **run.provenance,
            "source_digest": run.source_digest,
            **seed,
            "study": run.study.text,
        },
        "stored_run": run,
    }


def responses_in_focus(run: Run, chosen: Sequence[str] = ()) -> list[str]:
    """Return the chosen responses; else those with a limit, else the first eight.

    Raises
    ------
    QuestionError
        If a name is not one of the run's responses.
    """
    names = [response.name for response in run.responses]
    chosen = [chosen] if isinstance(chosen, str) else chosen
    for name in chosen:
        if name not in names:
            allowed = allowed_names(name, names)
            raise QuestionError(f"response {name}: unknown; {allowed}")
    return list(dict.fromkeys(chosen)) or list(run.limits) or names[:MOST_IN_FOCUS]


def predicted_seconds(run: Run, trials: int) -> float:
    """Return how many seconds a run takes until it has so many trials."""
    seconds: float = run.times["seconds"]
    return seconds / max(run.ended, 1) * max(trials - run.ended, 0)


def predicted_time(run: Run, trials: int) -> str:
    """Return about how long a run takes until it has so many trials, in words.

    At the rate of its trials so far. They took the compilation and the audit, too: so
    it may take less.
    """
    seconds = predicted_seconds(run, trials)
    for unit, length in UNITS:
        if seconds >= length:
            return f"about {max(seconds / length, 2):.0f} {unit}"
    return "less than a minute"


def notes_of(run: Run, sample: Sample | None) -> Iterator[str]:
    """Yield the notes for readers of a run's numbers, failures first.

    `sample`: the trials that its statistics rest on; None where they were not sampled.
    """
    if run.ended and not run.aim:  # trials of a search fail more often than production
        yield _failed(run, sample)
        yield from _outputs(run)
    if run.rerun:
        yield _rerun(run, run.rerun)
    if run.deciding:
        yield f"{run.ended} trials have run; {NOT_DECIDED}"
    elif run.ended < run.trials:
        missing = run.trials - run.ended
        yield f"{missing} of {run.trials} trials have not run"
    if run.complete and run.steps is not None and run.audited is None:
        why = run.diagnostics.missing or "the model has no tighter settings"
        yield f"integration errors are not audited: {why}"
    nominal = run.nominal_values["status"]
    if nominal != Status.DONE.word:
        yield f"the nominal trial: {nominal}"
    yield from (*run.warnings, *run.notes)
    if numbers := [_in_words(run, number) for number in run.numbers if number.of]:
        more = "" if len(numbers) <= MOST_NUMBERS else ", and others"
        words = ", ".join(numbers[:MOST_NUMBERS])
        sources = (
            "tolerances and measured parts" if run.measured else "tolerances alone"
        )
        yield f"from {sources}: {words}{more}"
    if run.stopped:
        yield _stopped(run, run.stopped)
    if run.path == IN_MEMORY:
        yield (
            f'commands name {SAVED}, which tolstat.save(run, "{SAVED}") writes: the '
            "run is in memory"
        )


def _stopped(run: Run, stopped: Stopped) -> str:
    stages, rules = ", ".join(map(str, stopped.stages)), "; ".join(stopped.rules)
    if stopped.decides:
        enough = "are enough" if stopped.reached else "are not enough"
        seconds = f"{figures(run.times['seconds'], 2)} s"
        text = f"{rules}: {stages} trials {enough} for every limit ({seconds})"
        if thinned := run.thinned:
            text += (
                f". {thinned.drawn[-1]:.0f} random trials were drawn; after the first "
                f"{thinned.plain} mainly uncertain ones were evaluated. Verdicts, "
                "fractions out of limit and remedies rest on all of them, other "
                f"numbers on the first {thinned.plain}"
            )
            if thinned.skips:
                text += (
                    f". A limit that permits less than {RARE * 1e6:.0f} ppm is met if "
                    "no out-of-limit region lies apart from those found: the first "
                    f"{thinned.plain} trials bound such a region at "
                    f"{PPM.at_most(thinned.unseen)} ppm"
                )
    else:
        reached = "reached" if stopped.reached else "not reached"
        text = f"{rules}: {reached}, checked after {stages} trials"
    if math.isfinite(needed := stopped.wanted) and needed:
        text += f"; about {needed:.0f} would be needed"
    return text


def _failed(run: Run, sample: Sample | None) -> str:
    text = f"{run.failed} of {run.ended} trials failed"
    if sample and len(sample.status) < run.trials:
        ran = int(np.count_nonzero(sample.ran))
        text += f", {sample.failed} of the {ran} that statistics rest on"
    if sample and (share := sample.failures).sure:
        _, lower, upper = PER_CENT.interval(*share[:3])
        text += f" (95 % interval {lower} to {upper} %)"
    if words := ", ".join(f"{count} {word}" for word, count in run.failures.items()):
        text += f": {words}; they count as out of every limit"
    return text


def _outputs(run: Run) -> Iterator[str]:
    """Yield what the first failed trials printed last, or why they failed."""
    output = run.isolation.output if run.isolation else {}
    for trial, text in [*output.items()][:MOST_OUTPUTS]:
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        why = " ... ".join(dict.fromkeys([lines[0], lines[-1]])) if lines else ""
        yield f"trial {trial}, {run.ended_as(trial)}: {why}"


def _rerun(run: Run, rerun: Audited) -> str:
    """Return how failed trials ended when they were evaluated again."""
    settings = ", ".join(
        f"{name} = {typed_setting(run, name, value)}"
        for name, value in rerun.settings.items()
    )
    codes, counts = np.unique(rerun.status, return_counts=True)
    pairs = zip(codes.tolist(), counts, strict=True)
    ended = ", ".join(f"{count} {run.words[code]}" for code, count in pairs)
    return (
        f"{len(rerun.trials)} failed trials evaluated again with {settings}: {ended}; "
        "they still count as failed"
    )


def _in_words(run: Run, number: StudyNumber) -> str:
    """Return a number of the study in words, with its caveat."""
    value = run.scale_of(number).words(number.value)
    if math.isnan(number.value):
        value = "none"
    caveat = f" ({number.caveat})" if number.caveat else ""
    return f"{number.name} {value}{caveat}"
