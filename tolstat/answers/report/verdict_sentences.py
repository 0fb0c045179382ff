"""The verdict in three sentences: who drives the machines beyond, who the spread."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from tolstat.answers.report.findings import (
    Culprit,
    Culprits,
    Findings,
    PairCulprit,
    ResponseFindings,
    clear_of,
)
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.limits.yields import MET, NOT_MET, UNDECIDED

MATTERS = 0.05  # share of the variance from which a contributor is named
MOST = 3  # sentences
WORST_FIRST = (NOT_MET, UNDECIDED, MET)
UNKNOWN = Estimate(math.nan)

Path = list[str | int]


class Driver(NamedTuple):
    """What clearly differs among the machines beyond some limits.

    Attributes
    ----------
    name : str
        Of a contributor, or a kind of part; of a pair, what it does.
    parts : tuple of str
        The contributors that it stands for, if it is a kind or a pair.
    pair : bool
        Whether it is a pair.
    limits : list of (str, path)
        Limited responses, the worst first, and where it stands among the culprits.
    instead : dict of str to (tuple of str, path)
        By response, where what halving gains cannot be told: of which parts of it it
        can, and where that stands.
    single : dict of str to (str, tuple of str, path)
        By response, of a pair: the single tolerance that gains more, the parts that it
        stands for if it is of a kind, and where that stands.
    """

    name: str
    parts: tuple[str, ...]
    pair: bool
    limits: list[tuple[str, Path]]
    instead: dict[str, tuple[tuple[str, ...], Path]]
    single: dict[str, tuple[str, tuple[str, ...], Path]]


class Within(NamedTuple):
    """Limited responses that no machine of the run is beyond."""

    names: list[str]


class Spread(NamedTuple):
    """To whom the variance of a response is owed.

    Attributes
    ----------
    name : str
        Of the response.
    beyond : str
        Why nobody is named for the machines beyond its limit; empty where somebody is,
        where none is beyond, and without a limit.
    shares : list of (str, path)
        At most three, the largest first.
    sure : bool
        Whether they have intervals.
    few_decide : bool
        Whether a few machines decide the variance: it is the least shares then.
    """

    name: str
    beyond: str
    shares: list[tuple[str, Path]]
    sure: bool
    few_decide: bool


def worst_first(responses: Mapping[str, ResponseFindings]) -> list[str]:
    """Name the limited responses: what is not met first, then the most beyond."""

    def place(name: str) -> tuple[int, float]:
        limited = responses[name].limited
        assert limited
        verdict, beyond = limited.yields.verdict, limited.yields.beyond.value
        return WORST_FIRST.index(verdict), -beyond

    return sorted((n for n, each in responses.items() if each.limited), key=place)


def sentences_of(found: Findings) -> list[Driver | Within | Spread]:
    """Choose what the first page says in words.

    Parameters
    ----------
    found : Findings
        Of a run.

    Returns
    -------
    list of Driver, Within or Spread
        At most three: who drives the machines beyond, the worst limit first, then what
        no machine is beyond, all in one; then who drives the spread, where that can be
        told, of those first for whose limit nobody is named.
    """
    ordered = worst_first(found.responses)
    drivers: dict[str, Driver] = {}
    for name in ordered:
        each = found.responses[name]
        culprits, parts = each.culprits, tuple[str, ...]()
        path: Path = ["responses", name, "culprits"]
        if culprits is None or not (culprits.pair or culprits.driving):
            continue
        culprit: Culprit | PairCulprit
        if pair := culprits.pair:
            culprit, who, parts = pair, pair.words, tuple(pair.together.members)
            path += ["pairs", culprits.pairs.index(pair)]
        else:
            who = culprits.driving[0]
            parts = each.members.get(who, ())
            kind = "kinds" if who in culprits.kinds else "contributors"
            culprit = getattr(culprits, kind)[who]
            path += [kind, who]
        driver = drivers.setdefault(who, Driver(who, parts, bool(pair), [], {}, {}))
        driver.limits.append((name, path))
        if not culprit.halved.sure and (gain := _gain_of_some(culprits, parts)):
            driver.instead[name] = gain[0], ["responses", name, "culprits", *gain[1]]
        if pair and (single := _single_that_gains_more(each, pair)):
            of, which = single
            parts = each.members.get(which, ()) if of == "kinds" else ()
            where: Path = ["responses", name, "culprits", of, which]
            driver.single[name] = which, parts, where
    told = {name for driver in drivers.values() for name, _ in driver.limits}
    none = [name for name in ordered if not _beyond(found.responses[name])]
    said: list[Driver | Within | Spread] = [*drivers.values()]
    said += [Within(none)] if none else []
    every = dict.fromkeys([*ordered, *found.interest])
    spreads = [
        spread_of(name, found.responses[name])
        for name in sorted(every, key=lambda name: (name in none, name in told))
        if found.responses[name].contributions
    ]
    said += [each for each in spreads if each.beyond or each.shares or each.few_decide]
    return said[:MOST]


def _gain_of_some(
    culprits: Culprits, parts: tuple[str, ...]
) -> tuple[tuple[str, ...], Path] | None:
    """Return where among the culprits the gain of some of the parts is told, if it is.

    Of the pair that explains most, else of the part that differs most clearly.
    """
    for i, pair in enumerate(culprits.pairs):
        members = pair.together.members
        if pair.halved.sure and set(members) <= set(parts):
            return members, ["pairs", i]
    for part in clear_of(culprits):
        if part in parts and culprits.contributors[part].halved.sure:
            return (part,), ["contributors", part]
    return None


def told_apart(one: Estimate, other: Estimate) -> bool:
    """Tell whether one share is known to be another than the other.

    Only where their intervals lie wholly apart: each end errs in 2.5 % of all runs, so
    that one of the two that face each other does in 5 % at most, however they err
    together. Of the difference itself, as the trials are the same, an interval would be
    narrower; none was measured to cover.
    """
    return one.upper < other.lower or other.upper < one.lower


def _single_that_gains_more(
    each: ResponseFindings, pair: PairCulprit
) -> tuple[str, str] | None:
    """Name the one tolerance whose halving leaves fewest beyond, beside a named pair.

    A contributor is held against either of the pair, a kind of part, which is several,
    against both at once. None where none gains more, or its gain is not known.
    """
    assert each.culprits and each.limited
    contributors = each.culprits.contributors
    either = [contributors[name].halved for name in pair.together.members]
    if not all(halved.sure for halved in (*either, pair.halved)):
        return None
    least = min(halved.value for halved in either)
    both = min(least, pair.halved.value)
    more, now = {}, each.limited.yields.beyond
    for of, culprits, most in (
        ("contributors", contributors, least),
        ("kinds", each.culprits.kinds, both),
    ):
        for name, culprit in culprits.items():
            halved = culprit.halved
            known = halved.upper < now.lower  # that it gains at all: see `told_apart`
            if known and halved.value < most:
                more[of, name] = halved.value
    return min(more, key=lambda place: more[place], default=None)


def _beyond(each: ResponseFindings) -> int:
    """Count the machines beyond the limit of a response, failed ones too."""
    return each.culprits.beyond if each.culprits else 0


def spread_of(name: str, each: ResponseFindings) -> Spread:
    """Name to whom the variance of a response is owed: groups, and single parts."""
    found, beyond = each.contributions, _nobody(each.culprits)
    if found is None:
        return Spread(name, beyond, [], True, False)
    grouped = {member for members in each.members.values() for member in members}
    single = [part for part in found.first_order if part not in grouped]
    known: dict[str, tuple[float, Path]] = {}
    for part in [*each.members, *single]:
        # what parts do together, where that can be told
        kinds = [
            kind
            for kind in ("together", "groups", "first_order")
            if not math.isnan(getattr(found, kind).get(part, UNKNOWN).value)
        ]
        if not kinds or (found.few_decide and kinds[0] != "together"):
            continue
        share = getattr(found, kinds[0])[part]
        size = share.lower if found.few_decide else share.value
        if MATTERS <= size <= 1 and not (share.sure and share.lower <= 0):
            known[part] = size, ["responses", name, "contributions", kinds[0], part]
    leading = sorted(known, key=lambda part: -known[part][0])[:3]
    paths = [(part, known[part][1]) for part in leading]
    sure = all(getattr(found, str(path[-2]))[part].sure for part, path in paths)
    return Spread(name, beyond, paths, sure, found.few_decide)


def _nobody(culprits: Culprits | None) -> str:
    """Say why no culprit is named; empty without a limit, and where one is."""
    if culprits is None or culprits.driving or culprits.pair or not culprits.beyond:
        return ""
    if culprits.reason == RANDOM_ONLY:
        return "culprits are named of random trials only"
    return culprits.reason or "nothing differs among those beyond by more than chance"
