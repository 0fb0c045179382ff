"""The same machines in two designs: what the difference is, trial by trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import PictureError, RunFileError
from tolstat.reporting.drawn import Drawn, drawn_trials
from tolstat.reporting.gather import responses_of_interest
from tolstat.reporting.plain import share_words
from tolstat.reporting.summary_table import (
    PER_CENT,
    Cell,
    estimate_in_words,
    summaries_of,
)
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.proportions import proportion
from tolstat.statistics.replicates import share_from_replicates
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import Summary, summarize
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.scale import Scale

Array = NDArray[np.float64]
SIDES = ("first", "second")


class Pair(NamedTuple):
    """Two runs of the same machines.

    Attributes
    ----------
    first, second : Drawn
        The runs.
    sample : Sample
        The machines: done where both are.
    responses : tuple of str
        Names that both runs have, in the order of the first.
    """

    first: Drawn
    second: Drawn
    sample: Sample
    responses: tuple[str, ...]

    def difference(self, response: str) -> Array:
        """Return second less first of all machines, SI; NaN where either failed."""
        return self.second.values(response) - self.first.values(response)


def pair_of(first: Run, second: Run) -> Pair:
    """Put two runs side by side.

    Parameters
    ----------
    first, second : Run
        Of the same deviations.

    Returns
    -------
    Pair
        With the responses that both have.

    Raises
    ------
    RunFileError
        If the deviations differ: it names the contributor and the trial.
    PictureError
        If machines were not drawn, or no response is in both.
    """
    _check_alike(first, second)
    A, B = drawn_trials(first), drawn_trials(second)
    if A is None or B is None:
        raise PictureError(
            f"{first.path} and {second.path}: machines of a grid or a table were "
            "chosen and not drawn, and have no statistics; `tolstat show --plot` draws "
            "them"
        )
    done = A.sample.done & B.sample.done
    ran = A.sample.ran & B.sample.ran
    if not done.any():
        raise PictureError(f"{first.path} and {second.path}: no trial is done in both")
    # how the trial failed does not matter here
    status = np.where(done, Status.DONE, np.where(ran, Status.NOT_FINITE, 0))
    units = second.units
    names = tuple(
        each.name for each in first.responses if units.get(each.name) == each.unit
    )
    if not names:
        raise PictureError(f"{first.path} and {second.path} have no response in common")
    return Pair(A, B, Sample(status, A.sample.replicates), names)


def _check_alike(first: Run, second: Run) -> None:
    """Refuse runs of different machines."""
    where = f"{first.path} and {second.path} are not of the same machines"
    if first.trials != second.trials:
        raise RunFileError(
            f"{where}: {first.trials} trials and {second.trials}; "
            f"give both studies the same trials and seed"
        )
    names = [contributor.name for contributor in first.contributors]
    others = [contributor.name for contributor in second.contributors]
    for name in dict.fromkeys([*names, *others]):
        columns = [
            run.column(name) if name in known else np.zeros(run.trials)
            for run, known in ((first, names), (second, others))
        ]
        different = np.flatnonzero(columns[0] != columns[1])
        if len(different):
            trial = int(different[0])
            values = ", ".join(repr(float(column[trial])) for column in columns)
            unit = {**second.units, **first.units}[name]
            raise RunFileError(
                f"{where}: {name} differs in {len(different)} of {first.trials} "
                f"trials, first in trial {trial} ({values} {unit}); give both studies "
                "the same seed, sampling and [deviations]"
            )


class SideFindings(NamedTuple):
    """One of the two runs: what it is, and how it came to be."""

    title: str
    run: str
    model: str
    done: int
    failed: int
    started_at: str
    source_digest: str
    version_tolstat: str


class PairFindings(NamedTuple):
    """The machines of both: asked, done in both, failed in one, and what was drawn."""

    asked: int
    done_in_both: int
    failed: int
    failures: Estimate
    promise: str


@dataclass(frozen=True)
class Sided(Summary):
    """A response in one of the designs, with that of its nominal machine."""

    nominal: float


@dataclass(frozen=True)
class ResponseCompared:
    """A response in both designs.

    Attributes
    ----------
    sentence : str
        What it is.
    scale : Scale
        How it is shown: as the first study has it.
    first, second : Sided
        In each design.
    difference : Summary
        Second less first, machine by machine.
    smaller, larger : Estimate
        Share of the machines in which the second is smaller, or larger.
    """

    sentence: str
    scale: Scale
    first: Sided
    second: Sided
    difference: Summary
    smaller: Estimate
    larger: Estimate


@dataclass(frozen=True)
class Comparison:
    """What a comparison says; SI, differences are second less first.

    Attributes
    ----------
    first, second : SideFindings
        The runs.
    settings : dict of str to tuple of str
        Those that differ, as they are written.
    trials : PairFindings
        The machines of both.
    interest : tuple of str
        Responses that are looked at closely.
    responses : dict of str to ResponseCompared
        All that both have.
    """

    first: SideFindings
    second: SideFindings
    settings: Mapping[str, tuple[str, str]]
    trials: PairFindings
    interest: tuple[str, ...]
    responses: Mapping[str, ResponseCompared]


def compared(pair: Pair, chosen: Sequence[str] = ()) -> Comparison:
    """Gather what a comparison says.

    Parameters
    ----------
    pair : Pair
        Two runs of the same machines.
    chosen : sequence of str
        Responses to be looked at closely; what has a limit if none are given.
    """
    first, second = pair.first.run, pair.second.run
    wanted = [
        name for run in (first, second) for name in responses_of_interest(run, chosen)
    ]
    summaries = [summaries_of(pair.first), summaries_of(pair.second)]
    responses = {}
    for response in first.responses:
        name = response.name
        if name not in pair.responses:
            continue
        difference = pair.difference(name)
        before, after = (
            Sided(**vars(of[name]), nominal=run.nominal_values[name])
            for of, run in zip(summaries, (first, second), strict=True)
        )
        responses[name] = ResponseCompared(
            response.sentence,
            first.scales[name],
            before,
            after,
            summarize(
                difference,
                pair.sample,
                declared=_range_of_difference(first, second, name),
            ),
            _share(difference < 0, pair.sample),
            _share(difference > 0, pair.sample),
        )
    done = pair.sample.done
    return Comparison(
        _side(pair.first),
        _side(pair.second),
        {
            name: (chosen_in.words, second.settings[name].words)
            for name, chosen_in in first.settings.items()
            if name in second.settings
            and chosen_in.words != second.settings[name].words
        },
        PairFindings(
            len(done),
            int(np.count_nonzero(done)),
            pair.sample.failed,
            pair.sample.failures,
            pair.first.sampled.promise,
        ),
        tuple(name for name in dict.fromkeys(wanted) if name in pair.responses),
        responses,
    )


def _range_of_difference(
    first: Run, second: Run, name: str
) -> tuple[float, float] | None:
    """Return what the difference cannot leave, where both runs declare their range."""
    a, b = ({r.name: r.range for r in run.responses}[name] for run in (first, second))
    return None if a is None or b is None else (b[0] - a[1], b[1] - a[0])


def _share(machines: NDArray[np.bool_], sample: Sample) -> Estimate:
    """Estimate a share of the machines that are done in both."""
    done = sample.done
    if sample.replicates:
        return share_from_replicates(machines[done], sample.replicate[done])
    return proportion(int(machines[done].sum()), int(done.sum()))


def _side(drawn: Drawn) -> SideFindings:
    run = drawn.run
    return SideFindings(
        run.title,
        run.path.name,
        run.model,
        int(np.count_nonzero(drawn.sample.done)),
        drawn.sample.failed,
        run.provenance["started_at"],
        run.source_digest,
        run.provenance["version_tolstat"],
    )


class ComparisonTable(NamedTuple):
    """The table of a comparison for the screen; cells as of `SummaryTable`."""

    title: str
    heads: list[str]
    rows: list[list[Cell]]
    notes: list[str]


def comparison_table(found: Comparison) -> ComparisonTable:
    """Summarize a comparison for the screen, in the units of the first study."""
    rows: list[list[Cell]] = []
    for name, each in found.responses.items():
        quantiles = each.difference.quantiles
        estimates = [
            each.first.quantiles[0.95],
            each.second.quantiles[0.95],
            quantiles[0.5],
            quantiles[0.95],
        ]
        row: list[Cell] = [name, each.scale.mark]
        row += [estimate_in_words(estimate, each.scale) for estimate in estimates]
        row.append(estimate_in_words(each.smaller, PER_CENT))
        rows.append(row)
    settings = "; ".join(
        f"{name}: {a} and {b}" for name, (a, b) in found.settings.items()
    )
    trials, share = found.trials, share_words(0.95)
    notes = [
        f"A: {found.first.run}, {found.first.failed} failed; "
        f"B: {found.second.run}, {found.second.failed} failed; "
        f"{trials.done_in_both} of {trials.asked} trials done in both",
        f"settings that differ: {settings or 'none'}",
        f"with each number its 95 % interval; {trials.promise}",
    ]
    return ComparisonTable(
        "the same machines, B less A",
        ["response", "unit", f"A: {share}", f"B: {share}", "B - A: median",
         f"B - A: {share}", "% smaller in B"],
        rows,
        notes,
    )  # fmt: skip
