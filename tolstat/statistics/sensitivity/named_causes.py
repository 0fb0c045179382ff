"""The contributors that are named as causes of units out of limit."""

import math
from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.sensitivity.out_of_limit import (
    CLEAR,
    Difference,
    Ranked,
    dependent,
    differences,
    holm,
    larger,
    own_parts,
)
from tolstat.statistics.sensitivity.pairs import Together, pairs

LEAST = 10  # units out of limit from which causes are named
TELLING = 40  # with which four of five studies name the right ones
MOST = 0.5  # share out of limit above which none are named
UNTESTED = Difference(math.nan, math.nan, 1.0)
ALIKE = 0.01  # relative difference of effects below which parts are equal
DIFFERS = 0.002  # level at which two of these, or of one kind, differ


class Effect(NamedTuple):
    """What is known of a contributor without any trial."""

    distribution: Hashable  # equal for equal ones
    size: float  # slope of the response at the nominal unit, times sigma, or NaN
    kind: str  # of part; empty if none


class Named(NamedTuple):
    """A contributor, or several that the units out of limit do not tell apart."""

    members: tuple[str, ...]
    level: float  # p-value, corrected for all tests of a limit
    correlated: bool = False  # otherwise several are equivalent


class NamedCauses(NamedTuple):
    """Causes of the units out of one limit, the clearest first."""

    differences: dict[str, Difference]  # by contributor, levels corrected
    parts: list[Named]
    pairs: list[Together]

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """The contributors of each named cause."""
        return [e.members for e in self.parts] + [e.members for e in self.pairs]


def may_be_told(out: Truths) -> bool:
    """Return whether so many units are out of limit that causes can be named."""
    return LEAST <= int(out.sum()) <= MOST * len(out)


def named_causes(
    deviations: Mapping[str, Array],
    out: Mapping[str, Truths],
    effects: Mapping[str, Mapping[str, Effect]],
) -> dict[str, NamedCauses]:
    """Name the causes of units out of limit.

    Parameters
    ----------
    deviations, out
        As of `differences`.
    effects : mapping of str to mapping of str to Effect
        Of each contributor, by response.

    Notes
    -----
    Tested are each contributor, the sum over each class of equal slope and
    distribution, and of correlated contributors also what the others do not tell. The
    levels of these tests are corrected after Holm, and doubled: pairs have the other
    half of the errors. A significant contributor is named, with those of its class, or
    significant ones of its kind, that do not differ significantly from it. A class, or
    correlated contributors, are named as a whole if no member is significant.
    """
    tested = {n: units for n, units in out.items() if may_be_told(units)}
    columns, names = dict[Any, Array](deviations), list(deviations)
    sums = dict[str, dict[Any, Array]]()  # over equal parts, by response
    batches, equal = dict[str, tuple[str, ...]](), dict[str, list[tuple[str, ...]]]()
    if tested and names:
        linked = dependent(deviations)
        for name, row in zip(names, linked, strict=True):
            if row.sum() > 1:
                batches[name] = tuple(names[k] for k in np.flatnonzero(row))
        remainders = own_parts(deviations, linked)
        columns |= {("", n): remainders[n] for n in batches if n in remainders}
    for response in tested:
        independent = {n: effects[response][n] for n in names if n not in batches}
        equal[response] = equal_parts(independent)
        for members in equal[response]:
            signed = [np.sign(independent[n].size) * deviations[n] for n in members]
            sums.setdefault(response, {})[members] = np.sum(signed, axis=0)
    tests, together = differences(columns, out), pairs(deviations, tested)
    for response, by_members in sums.items():
        tests[response] |= differences(by_members, {response: out[response]})[response]
    ranked = Ranked(deviations, np.logical_or.reduce([*out.values()]))
    causes = {}
    for response, units in out.items():
        raw = tests[response]
        doubled = 2 * holm(np.array([difference.level for difference in raw.values()]))
        levels = dict(zip(raw, np.minimum(doubled, 1.0).tolist(), strict=True))
        parts: list[Named] = []
        if response in tested:
            alone = {n: levels.get(("", n), 1.0) if n in batches else levels[n]
                     for n in names if n in raw}  # fmt: skip
            scores = dict(zip(names, ranked.scores(units), strict=True))
            z = {n: scores[n] for n in alone}
            classes = {e: levels[e] for e in equal[response]}
            parts = _parts(alone, classes, effects[response], z)
            for batch in dict.fromkeys(batches.values()):
                level = min(levels[n] for n in batch)
                if level < CLEAR and not any({*batch} & {*e.members} for e in parts):
                    parts.append(Named(batch, level, correlated=True))
        complete = [{*part.members} for part in parts if len(part.members) > 2]
        corrected = {n: raw[n]._replace(level=levels[n]) for n in names if n in raw}
        causes[response] = NamedCauses(
            {n: corrected.get(n, UNTESTED) for n in names},
            sorted(parts, key=lambda part: part.level),
            [pair for pair in together.get(response, ())
             if not any(members >= {*pair.members} for members in complete)],
        )  # fmt: skip
    return causes


def equal_parts(effects: Mapping[str, Effect]) -> list[tuple[str, ...]]:
    """Return the contributors of equal slope and distribution, two or more each."""
    alike: dict[Hashable, list[list[str]]] = {}  # classes by distribution
    leads: dict[Hashable, list[float]] = {}  # size of their first members
    classes: list[list[str]] = []
    for name, (distribution, size, _) in effects.items():
        sizes = np.array(leads.setdefault(distribution, []))
        near = np.abs(abs(size) - sizes) < ALIKE * np.maximum(abs(size), sizes)
        if near.any():
            alike[distribution][int(near.argmax())].append(name)
        else:
            classes.append([name])
            alike.setdefault(distribution, []).append(classes[-1])
            leads[distribution].append(abs(size))
    return [tuple(members) for members in classes if len(members) > 1]


def _parts(
    alone: Mapping[str, float],
    classes: Mapping[tuple[str, ...], float],
    effects: Mapping[str, Effect],
    z: Mapping[str, Array],
) -> list[Named]:
    """Return significant contributors and classes; levels of each are given."""
    remaining = {n: level for n, level in alone.items() if level < CLEAR}
    for members, level in classes.items():  # the clearest stands for its class
        if level < CLEAR and not remaining.keys() & {*members}:
            remaining[min(members, key=lambda n: alone[n])] = level
    named: list[Named] = []
    while remaining:
        lead = min(remaining, key=lambda n: remaining[n])
        kind, same = effects[lead].kind, next((e for e in classes if lead in e), ())
        peers = [
            n for n in z
            if n != lead and not any(n in cause.members for cause in named)
            and (n in same or (n in remaining and kind and effects[n].kind == kind))
        ]  # fmt: skip
        least = DIFFERS / max(len(peers) * (len(peers) + 1) / 2, 1)  # of all pairs
        levels = _levels_apart(z[lead], np.array([z[n] for n in peers]))
        differing = {n for n, level in zip(peers, levels, strict=True) if level < least}
        members = tuple(n for n in z if n == lead or n in {*peers} - differing)
        named.append(Named(members, remaining[lead]))
        remaining = {n: p for n, p in remaining.items() if n not in named[-1].members}
    return named


def _levels_apart(first: Array, others: Array) -> Array:
    """Return the levels at which an effect differs from others, float64[other, unit].

    Scores are of units out of limit. Units with two equivalent parts exchanged are as
    likely: a paired t test. Scores to the side of the mean and distances are compared;
    the smaller level counts, doubled.
    """
    if not len(others):
        return np.empty(0)
    a, b = (np.copysign(1.0, z.mean(-1, keepdims=True)) * z for z in (first, others))
    pairs_of_scores = ((a, b), (b, a), (np.abs(a), np.abs(b)), (np.abs(b), np.abs(a)))
    return np.asarray(4 * np.min([larger(*pair) for pair in pairs_of_scores], axis=0))
