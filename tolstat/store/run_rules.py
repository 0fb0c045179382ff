"""What holds of every run that tolstat writes, checked once, when its file is opened.

All that reads a run relies on it: a file may be a stranger's.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

import numpy as np

from tolstat.arrays import Integers
from tolstat.deviations.draw import SAMPLERS
from tolstat.deviations.names import general
from tolstat.deviations.samplers import DISTANCE, SPREAD, STAGE, WEIGHT
from tolstat.statistics.intervals.weights import COLUMNS, Thinned
from tolstat.status import Status, words_of
from tolstat.store.assumed import SCORES
from tolstat.store.layout import TRIAL
from tolstat.store.run_records import STATUS, STEPS, Audited, Sampled
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

MOST = 1e150  # of a number, so that its square is one
RARE = (STAGE, SPREAD, DISTANCE, WEIGHT)  # columns of the sampler
TABLE = "table"  # the sampling whose trials may be a sample
MOST_DRAWN = 1e12  # trials
LONGEST = 1e10  # s of a run
LONGEST_OUTPUT = 4000  # characters of a trial
LONGEST_TITLE = 100_000  # characters
SECTIONS = (
    "settings", "deviations", "limits", "links", "gaps", "loops", "responses", "cases",
    "grid", "correlation",
)  # fmt: skip
SIDES = {"least", "largest"}


def finite(*numbers: float) -> bool:
    """Return whether all numbers are finite, and not beyond all bounds."""
    return all(abs(number) <= MOST for number in numbers)


def number_or_none(*numbers: float) -> bool:
    """Return whether all numbers are finite or NaN."""
    return all(math.isnan(number) or abs(number) <= MOST for number in numbers)


def ascending(*numbers: float) -> bool:
    """Return whether numbers ascend, where they are numbers."""
    present = [number for number in numbers if not math.isnan(number)]
    return present == sorted(present)


def within(names: Collection[Any], allowed: Collection[Any]) -> bool:
    """Return whether all names are different and among the allowed ones."""
    return len({*names}) == len(names) and {*names} <= {*allowed}


def _columns(run: Run) -> bool:
    names = [column.name for column in (*run.described, *run.details)]
    others = {TRIAL, STATUS, STEPS} & {*run.columns}
    return within(["", *names], ["", *{*run.columns} - others]) and (
        len(names) + len(others) == len(run.columns)
    )


def _numbers(run: Run) -> bool:
    """Columns have numbers; those of a response in every trial that is done."""
    inputs = [run.columns[contributor.name] for contributor in run.contributors]
    results = [run.columns[response.name] for response in run.responses]
    healthy = np.ones(run.trials, bool)
    healthy[run.damage.trials] = False
    done = healthy & (run.status == Status.DONE)
    return (
        all(values.dtype == float for values in (*inputs, *results))
        and not any(np.isinf(values[healthy]).any() for values in inputs)
        and all(np.abs(values[done]).max(initial=0.0) <= MOST for values in results)
        and {*np.unique(run.status[healthy]).tolist()} <= {*run.words}
        and int(run.nominal_results.status[0]) in run.words
    )


def _words(run: Run) -> bool:
    return (
        run.words.items() >= words_of().items()
        and within(list(run.words.values()), run.words.values())
        and all(0 <= code < 256 for code in run.words)
    )


def _units(run: Run) -> bool:
    scales = {Scale(c.unit, c.shown or c.unit) for c in (*run.described, *run.numbers)}
    return all(scale.factor > 0 for scale in scales)


def _limits(run: Run) -> bool:
    return within(run.limits, [response.name for response in run.responses]) and all(
        limit.lower <= limit.upper
        and limit.ends > 0
        and finite(*limit.finite)
        and 0.5 <= limit.demanded < 1
        and math.isfinite(limit.ppk)
        for limit in run.limits.values()
    )


def _descriptions(run: Run) -> bool:
    ranges = [response.range for response in run.responses if response.range]
    return all(finite(c.size or 0.0) for c in run.contributors) and all(
        low < high for low, high in ranges
    )


def _assumed(run: Run) -> bool:
    return within(run.assumed, [c.name for c in run.contributors]) and all(
        finite(
            *assumed.tolerance,
            *assumed.quantiles,
            assumed.centre,
            assumed.nominal_shift,
        )
        and ascending(*assumed.tolerance)
        and ascending(*assumed.quantiles)
        and len(assumed.quantiles) == len(SCORES)
        and number_or_none(assumed.mean, assumed.sigma)
        and not assumed.sigma < 0
        and 0 <= assumed.common <= 1
        and assumed.parts >= 0
        for assumed in run.assumed.values()
    )


def _measured(run: Run) -> bool:
    return all(
        sample.contributors
        and within(sample.contributors, run.assumed)
        and sample.parts > 0
        and finite(*sample.values)
        and ascending(*sample.values)
        and sample.fit in ("", "normal", "lognormal")
        and (sample.fit != "lognormal" or sample.values[0] > 0)
        and (not sample.fit or np.ptp(sample.values) > 0)
        and sample.lower < sample.upper
        and _ordered(sample.order, sample.parts)
        and _ordered_lots(sample.lot, sample.parts, len(sample.lot_names))
        for sample in run.measured
    )


def _ordered(order: Integers | None, parts: int) -> bool:
    """Return whether an order has each part once."""
    return order is None or np.array_equal(np.sort(order), np.arange(parts))


def _ordered_lots(lot: Integers | None, parts: int, lots: int) -> bool:
    """Return whether each part is of a lot."""
    if lot is None:
        return lots == 0
    return len(lot) == parts and bool(((lot >= 0) & (lot < lots)).all())


def _sampled(run: Run) -> bool:
    if run.sampled is None:
        return run.listed
    sampled: Sampled = run.sampled
    return (
        run.sampling in (*SAMPLERS, TABLE)
        and sampled.seed >= 0
        and 0 <= sampled.replicates <= run.trials
        and 1 <= sampled.group <= run.trials
        and within(sampled.factors, sampled.factors)
        and sampled.aim in {"", *run.limits}
        and bool(sampled.aim) == (run.sampling == "rare")
        and {detail.name for detail in run.details}
        == {*(RARE if sampled.aim else COLUMNS if run.thinned else ())}
        and all(run.columns[detail.name].dtype.kind in "if" for detail in run.details)
    )


def _thinned(run: Run) -> bool:
    """Check thinned trials: the first stage has all that it drew."""
    if run.thinned is None:
        return True
    healthy = ~np.isnan(run.thinned.drawn)
    healthy[run.damage.trials] = False
    rows = Thinned(*(values[healthy] for values in run.thinned))
    return (
        run.sampling == "random"
        and bool(healthy.any())
        and 0 < rows.plain <= run.trials
        and np.abs(rows.drawn).max() <= MOST_DRAWN
        and not np.any(np.diff(rows.drawn) < 0)
        and bool(np.all((rows.least != 0) & (np.abs(rows.least) <= rows.chance)))
        and rows.least[0] > 0
        and bool(np.all(rows.chance <= 1))
    )


def _stopped(run: Run) -> bool:
    stopped = run.stopped
    return stopped is None or (
        stopped.wanted >= 0
        and stopped.at_most > 0
        and ascending(0, *stopped.stages, run.trials)
    )


def _grid(run: Run) -> bool:
    # parts of one name are one axis
    names = {*run.input_names, *map(general, run.input_names)}
    return within(run.grid, names) and within([c.name for c in run.swept], run.grid)


def _audits(run: Run) -> bool:
    return all(_audit(run, audited) for audited in (run.audited, run.rerun) if audited)


def _audit(run: Run, audited: Audited) -> bool:
    trials, third = audited.trials, audited.third
    arrays = [
        audited.status, *audited.responses.values(), *audited.chosen_by.values(),
        *([audited.at_random] if audited is run.audited else ()),
    ]  # fmt: skip
    return (
        all(len(values) == len(trials) for values in arrays)
        and within(trials.tolist(), range(run.trials))
        and ascending(*trials.tolist())
        and {*audited.responses} == {response.name for response in run.responses}
        and within(audited.chosen_by, audited.responses)
        and within(audited.settings, run.settings)
        and finite(*audited.settings.values())
        and {*np.unique(audited.status).tolist()} <= {*run.words}
        and (third is None or (within(third.trials, trials) and _audit(run, third)))
    )


def _diagnostics(run: Run) -> bool:
    parts = [contributor.name for contributor in run.contributors]
    responses = [response.name for response in run.responses]
    stored = run.diagnostics
    estimates = [e.beyond for row in stored.halved.values() for e in row.values()]
    halved = {members for row in stored.halved.values() for members in row}
    cases = [case for sides in stored.worst_cases.values() for case in sides.values()]
    return (
        within(stored.slopes, responses)
        and within(stored.worst_cases, run.limits)
        and within(stored.halved, run.limits)
        and within(stored.idle, parts)
        and all(within(row, parts) for row in stored.slopes.values())
        and all(number_or_none(*row.values()) for row in stored.slopes.values())
        and all(within(row, SIDES) for row in stored.worst_cases.values())
        and all(within(case.deviations, parts) for case in cases)
        and all(number_or_none(case.value) for case in cases)
        and all(finite(*case.deviations.values()) for case in cases)
        and all(within(members, parts) for members in halved)
        and all(ascending(e.lower, e.value, e.upper) for e in estimates)
    )


def _study_numbers(run: Run) -> bool:
    responses = ["", *(response.name for response in run.responses)]
    names = [number.name for number in run.numbers]
    return within(names, names) and all(
        number.of in responses
        and number.worst in {"", *SIDES}
        and number_or_none(number.value)
        for number in run.numbers
    )


def _reference(run: Run) -> bool:
    columns = run.reference.columns if run.reference else {}
    return (
        within(columns, run.units)
        and len({len(values) for values in columns.values()}) <= 1
        and all(np.isfinite(values).all() for values in columns.values())
    )


def _correlation(run: Run) -> bool:
    parts = [contributor.name for contributor in run.contributors]
    rows: Mapping[str, Mapping[str, float]] = run.correlation
    return within(rows, parts) and all(
        within(row, parts) and all(abs(rank) <= 1 for rank in row.values())
        for row in rows.values()
    )


def _study(run: Run) -> bool:
    table = run.study.table
    return (
        all(isinstance(table.get(name, {}), dict) for name in SECTIONS)
        and len(run.title) <= LONGEST_TITLE
        and run.model != ""
        and {"version_tolstat", "started_at"} <= {*run.made}
    )


def _isolation(run: Run) -> bool:
    longest, output = run.isolation or (0.0, {})
    return 0 <= longest < LONGEST and all(
        0 <= trial < run.trials and len(text) <= LONGEST_OUTPUT
        for trial, text in output.items()
    )


def _times(run: Run) -> bool:
    seconds = run.times["seconds"]
    return math.isnan(seconds) or 0 <= seconds < LONGEST


RULES: Mapping[str, Callable[[Run], bool]] = {
    "its columns are not those of its plan": _columns,
    "its words of a status are not those of tolstat": _words,
    "its columns have other numbers than those of trials": _numbers,
    "a unit is unknown": _units,
    "a nominal value or a range is wrong": _descriptions,
    "a limit is wrong": _limits,
    "an assumption on a deviation is wrong": _assumed,
    "its measured parts are wrong": _measured,
    "a word or number of its sampling is wrong": _sampled,
    "its thinned trials are wrong": _thinned,
    "its stopping rule is wrong": _stopped,
    "its grid is not of its columns": _grid,
    "its audited trials are wrong": _audits,
    "its diagnostics are wrong": _diagnostics,
    "a number of its study is wrong": _study_numbers,
    "its known points are wrong": _reference,
    "a correlation is wrong": _correlation,
    "its study is wrong": _study,
    "its longest trial or the output of a trial is wrong": _isolation,
    "its duration is wrong": _times,
}


def broken_rules(run: Run) -> Iterator[str]:
    """Yield what is wrong with a run, the first first."""
    return (words for words, rule in RULES.items() if not rule(run))
