"""Mistakes of an author that compiled equations would answer with wrong numbers.

Compiled code does not check an index: rates that read a parameter too many would read
what lies behind, and rates that fill a row too many would crash Python.
"""

from collections.abc import Callable

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.integrator.problem import MOMENT_ROWS, PHASE, TIME, Block, System

UNWRITTEN = -8.765e300  # no equation returns this
SPARE = 64  # rows after the declared ones
SAME = 1e-9  # relative difference of `watch` from the rates, by rounding
MOST_PHASES = 64  # that are tried


def check_block(system: System, block: Block) -> None:
    """Refuse arrays and tolerances that do not fit together.

    Raises
    ------
    ModelError
        With the name of the argument, what it is, and what is expected.
    """
    trials = len(block.start)
    for name, axes in (("start", 2), ("parameters", 3), ("marks", 2)):
        if len(shape := getattr(block, name).shape) != axes:
            words = "a row for each trial is expected"
            raise ModelError(f"integrate: {name} has shape {shape}: {words}")
    phases = block.marks.shape[1] - 1
    scale, (rtol, longest, most) = np.asarray(system.scale), block.accuracy
    function = "integrate"
    states = f"a size for each of {block.start.shape[1]} states is expected"
    fits = scale.shape == block.start.shape[1:]
    expect(fits, function, f"scale has shape {scale.shape}", states)
    sizes = np.all(scale > 0) and np.isfinite(scale).all()
    expect(sizes, function, f"scale {scale}", "sizes above zero are expected")
    for name, table in (("parameters", block.parameters), ("marks", block.marks)):
        rows = f"a row for each of {trials} trials is expected"
        expect(len(table) == trials, function, f"{name} has {len(table)} rows", rows)
    check_times(function, block.marks, block.samples)
    parts = block.parameters.shape[1]
    words = f"{phases}, one for each phase, or 1 is expected"
    expect(parts in (1, phases), function, f"parameters of {parts} phases", words)
    above = "a number above zero is expected"
    expect(0 < rtol < np.inf, function, f"rtol {rtol}", above)
    expect(longest > 0, function, f"max_step {longest}", above)
    expect(most > 0, function, f"max_steps {most}", above)
    allowed = f"a phase from 0 to {phases - 1} is expected"
    first = block.watch_from
    expect(0 <= first < phases, function, f"watch_from {first}", allowed)


def expect(holds: bool | np.bool_, function: str, fact: str, words: str) -> None:
    """Refuse what was given to a function, unless it holds what is expected."""
    if not holds:
        raise ModelError(f"{function}: {fact}: {words}")


def check_times(function: str, marks: Array, samples: Array) -> None:
    """Refuse times that do not ascend or are not finite, and samples outside marks.

    Raises
    ------
    ModelError
        With the name of the argument, what it is, and what is expected.
    """
    columns = marks.shape[1]
    needed = "start and end are needed"
    expect(columns > 1, function, f"marks has {columns} columns", needed)
    expect(np.isfinite(marks).all(), function, "marks", "finite times are expected")
    for name, times in (("marks", marks), ("samples", samples)):
        ascend = np.all(np.diff(times) >= 0)
        expect(ascend, function, name, "ascending times are expected")
    if len(marks) and len(samples):
        first, last = marks[:, 0].max(), marks[:, -1].min()
        inside = first <= samples[0] and samples[-1] <= last
        fact = f"samples from {samples[0]:g} to {samples[-1]:g} s"
        within = f"times from {first:g} to {last:g} s are expected, start and end"
        expect(inside, function, fact, within)


def check_equations(system: System, block: Block) -> None:
    """Refuse equations that read or fill other rows than declared.

    They are evaluated for the first trials, next to their start.

    Raises
    ------
    ModelError
        If they do, or if `watch` returns other numbers than the rates.
    """
    if not len(block.start):
        return
    counts = {
        "states": block.start.shape[1],
        "quadratures": system.n_quadratures,
        "extremes": system.n_extremes,
        "above": system.n_above,
        "damped": len(system.damped),
        "slopes": len(system.damped) * len(system.sloped),
    }
    rates = _filled("rates", system.rates, counts, system, block)
    if system.watch and system.n_watched:
        watched = {name: counts[name] for name in ("extremes", "above")}
        seen = _filled("watch", system.watch, watched, system, block)
        first = counts["states"] + counts["quadratures"]
        same = np.isclose(seen, rates[first : first + len(seen)], SAME, 0, True)
        if not same.all():
            row = int(np.flatnonzero(~same.all(axis=1))[0])
            raise ModelError(
                f"watch fills row {row} with other numbers than rates its row "
                f"{first + row}; give the watched quantities in the same order, by the "
                "same formulas"
            )
    if system.jump:
        sides = {"states": counts["states"], "crossings": len(system.crossings)}
        _filled("jump", system.jump, sides, system, block)


def _filled(
    name: str,
    equations: Callable[..., None],
    declared: dict[str, int],
    system: System,
    block: Block,
) -> Array:
    """Return the rows that equations fill; refuse others than declared."""
    from tolstat.lanes.vector import WIDTH  # loads the compiler

    trials = np.arange(WIDTH) % len(block.start)
    moments = [
        (phase, side)
        for phase in _some(block.marks.shape[1] - 1)
        for side in ((1.0, 0.0, -1.0) if system.crossings else (1.0,))
    ]
    start, by_phase = block.start[trials].T, block.parameters[trials].T
    # not at the start itself, where quantities often are zero and equal
    nearby = np.linspace(0.1, 0.9, start.size).reshape(start.shape)
    start = start + nearby * system.scale[:, None]
    rows, filled = sum(declared.values()), []
    words = ", ".join(f"{n} {kind}" for kind, n in declared.items() if n)
    for phase, side in moments:
        tables, parameters = [], by_phase[:, min(phase, by_phase.shape[1] - 1)]
        for behind in (0.0, 1.0, np.nan):
            out = np.full((rows + SPARE, WIDTH), UNWRITTEN)
            spare = np.full((SPARE, WIDTH), behind)
            moment = np.full((MOMENT_ROWS + len(system.crossings), WIDTH), side)
            moment[TIME], moment[PHASE] = block.marks[trials, phase], phase
            # views: equations see the declared rows, and reach what lies behind
            arguments = [
                np.concatenate([array, spare])[: len(array)]
                for array in (moment, start, parameters)
            ]
            with np.errstate(all="ignore"):  # the place may be none that is reached
                equations(*arguments, out[:rows])
            for passed, before in zip(arguments[1:], (start, parameters), strict=True):
                if not np.array_equal(passed, before, equal_nan=True):
                    raise ModelError(f"{name} writes into y or p; it fills out alone")
            tables.append(out)
        written = (tables[0] != UNWRITTEN).any(axis=1)
        n_filled = 1 + int(np.flatnonzero(written).max(initial=-1))
        if n_filled != rows:
            raise ModelError(
                f"{name} fills {n_filled} rows, but {rows} are declared ({words}); "
                "make the counts of System match the rows of out"
            )
        if not written[:rows].all():
            row = int(np.flatnonzero(~written)[0])
            raise ModelError(f"{name} does not fill row {row} of out ({words})")
        if not all(np.array_equal(tables[0], x, equal_nan=True) for x in tables[1:]):
            raise ModelError(
                f"{name} reads more rows than there are: {len(start)} states, "
                f"{len(parameters)} parameters and {len(system.crossings)} sides are "
                "given; give integrate every parameter, and name each crossing whose "
                "side is read in System"
            )
        filled.append(tables[0][:rows])
    return np.concatenate(filled, axis=1)


def _some(phases: int) -> range:
    """Return the numbers of all phases, or of every so many where there are many."""
    return range(0, phases, 1 + phases // MOST_PHASES)
