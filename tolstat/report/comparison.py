"""The same machines in two designs: what the difference is, trial by trial."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import PictureError, RunFileError
from tolstat.report.drawn import Drawn, drawn_trials
from tolstat.report.findings import responses_of_interest, summary_found
from tolstat.report.plain import Found, estimate, estimate_from, share_words
from tolstat.report.summary_table import Cell, estimate_in_words, summaries_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.proportions import proportion
from tolstat.statistics.replicates import share_from_replicates
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import summarize
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

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


def compared(pair: Pair, chosen: Sequence[str] = ()) -> Found:
    """Gather what a comparison says.

    Parameters
    ----------
    pair : Pair
        Two runs of the same machines.
    chosen : sequence of str
        Responses to be looked at closely; what has a limit if none are given.

    Returns
    -------
    dict
        Plain data, SI, as of `findings_of`. Differences are second less first.
    """
    first, second = pair.first.run, pair.second.run
    interest = [
        name
        for name in dict.fromkeys(
            [
                *responses_of_interest(first, chosen),
                *responses_of_interest(second, chosen),
            ]
        )
        if name in pair.responses
    ]
    sides = dict(zip(SIDES, (pair.first, pair.second), strict=True))
    summaries = {side: summaries_of(drawn) for side, drawn in sides.items()}
    responses = {}
    for response in first.responses:
        name = response.name
        if name not in pair.responses:
            continue
        difference = pair.difference(name)
        found: Found = {
            "sentence": response.sentence,
            "unit": response.unit,
            "shown_unit": engineering_unit(response.unit),
            "difference": summary_found(summarize(difference, pair.sample)),
            "smaller": estimate(_share(difference < 0, pair.sample)),
            "larger": estimate(_share(difference > 0, pair.sample)),
        }
        for side, drawn in sides.items():
            found[side] = summary_found(summaries[side][name])
            found[side]["nominal"] = drawn.run.nominal_values[name]
        responses[name] = found
    done = pair.sample.done
    return {
        "first": _named(pair.first),
        "second": _named(pair.second),
        "settings": _settings(first, second),
        "trials": {
            "asked": len(done),
            "done_in_both": int(np.count_nonzero(done)),
            "failed": pair.sample.failed,
            "failures": estimate(pair.sample.failures),
            "promise": first.facts["promise"],
        },
        "interest": interest,
        "responses": responses,
    }


def _share(machines: NDArray[np.bool_], sample: Sample) -> Estimate:
    """Estimate a share of the machines that are done in both."""
    done = sample.done
    if sample.replicates:
        return share_from_replicates(machines[done], sample.replicate[done])
    return proportion(int(machines[done].sum()), int(done.sum()))


def _named(drawn: Drawn) -> Found:
    run = drawn.run
    return {
        "title": run.facts["title"],
        "run": run.path.name,
        "model": run.facts["model"],
        "failed": drawn.sample.failed,
        "started_at": run.facts["started_at"],
        "source_digest": run.facts["source_digest"],
        "version_tolstat": run.facts["version_tolstat"],
    }


def _settings(first: Run, second: Run) -> Found:
    """List the settings that the two studies do not share, as they are written."""
    tables = [run.study.table.get("settings", {}) for run in (first, second)]
    return {
        name: [str(table.get(name, "as by default")) for table in tables]
        for name in dict.fromkeys([*tables[0], *tables[1]])
        if tables[0].get(name) != tables[1].get(name)
    }


class ComparisonTable(NamedTuple):
    """The table of a comparison for the screen; cells as of `SummaryTable`."""

    title: str
    heads: list[str]
    rows: list[list[Cell]]
    notes: list[str]


def comparison_table(found: Found) -> ComparisonTable:
    """Summarize a comparison for the screen, engineering units."""

    def cell(each: Found, unit: str) -> Cell:
        return estimate_in_words(estimate_from(each), unit)

    rows: list[list[Cell]] = []
    share = share_words(0.95)
    for name, each in found["responses"].items():
        unit = each["unit"]
        row: list[Cell] = [name, each["shown_unit"]]
        row += [cell(each[side]["quantiles"][share], unit) for side in SIDES]
        quantiles = each["difference"]["quantiles"]
        row += [cell(quantiles[s], unit) for s in (share_words(0.5), share)]
        row.append(cell(each["smaller"], "1"))
        rows.append(row)
    settings = "; ".join(
        f"{name}: {a} and {b}" for name, (a, b) in found["settings"].items()
    )
    trials = found["trials"]
    notes = [
        f"A: {found['first']['run']}, {found['first']['failed']} failed; "
        f"B: {found['second']['run']}, {found['second']['failed']} failed; "
        f"{trials['done_in_both']} of {trials['asked']} trials done in both",
        f"settings that differ: {settings or 'none'}",
        f"with each number its 95 % interval; {trials['promise']}",
    ]
    return ComparisonTable(
        "the same machines, B less A",
        ["response", "unit", "A: 95 %", "B: 95 %", "B - A: median", "B - A: 95 %",
         "% smaller in B"],
        rows,
        notes,
    )  # fmt: skip
