"""The sections [deviations] and [correlation] of a study, read."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.deviations.dependence import (
    Batch,
    Dependence,
    correlation_of_scores,
    groups,
    pearson_of_rank,
    rank_of_pearson,
)
from tolstat.deviations.distributions import Constant, Distribution, Tolerance
from tolstat.deviations.measured import InOrder
from tolstat.deviations.names import expand
from tolstat.errors import DependenceError, DistributionError, ModelError
from tolstat.model.description import Contributor
from tolstat.model.setting_kinds import as_typed
from tolstat.study.distribution_entry import (
    DEFAULT,
    REMEDY_KEYS,
    keys_of,
    read_distribution,
    written_unit,
)
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.problems import Problems
from tolstat.study.study_schema import CorrelationEntry, read_entry

if TYPE_CHECKING:
    from tolstat.study.cost_entry import Priced

MEAN_WITHIN = "mean_within"  # key: the range of a mean that is not known
MOST_NOTED = 6  # pairs; the page has all
# by both names: of ranks, or { pearson = ... } or { spearman = ... }
Correlations = Mapping[str, Mapping[str, float | Mapping[str, float]]]


class Typed(NamedTuple):
    """The correlation of a pair."""

    rank: float
    pearson: float | None = None  # where this was typed


INDEPENDENT = Dependence()


@dataclass(frozen=True)
class Deviations:
    """Distributions of the deviations, and their correlations."""

    distributions: dict[str, Distribution] = field(default_factory=dict)  # by part, SI
    dependence: Dependence = INDEPENDENT  # batches and correlations
    # the distribution of each, as the study writes it
    words: dict[str, str] = field(default_factory=dict)
    entries: dict[str, str] = field(default_factory=dict)  # name of the entry of each
    units: dict[str, str] = field(default_factory=dict)  # in which each is written
    notes: list[str] = field(default_factory=list)  # for the summary of the run
    priced: "list[Priced]" = field(default_factory=list)  # tolerances and shifts
    # sentences that stand before the verdicts
    warnings: dict[str, None] = field(default_factory=dict)
    # contributors with a nominal value: see `tolstat.deviations.spread.fixed_point`
    sized: set[str] = field(default_factory=set)
    # how far the mean of each may move, SI, where it lies anywhere within a range
    means: dict[str, Tolerance] = field(default_factory=dict)
    measured: dict[str, InOrder] = field(default_factory=dict)  # by measured part


def read_deviations(
    entries: Mapping[str, str | dict[str, Any]],
    correlations: Correlations,
    contributors: Sequence[Contributor],
    folder: Path | None,
    problems: Problems,
    linked: Container[str] = (),
) -> Deviations:
    """Return the distributions of all deviations, and their correlations.

    `linked` are those of the section [links].
    """
    parts = {part.name: part for part in contributors}
    read, batches = Deviations(), dict[str, Batch]()
    distributions = read.distributions
    for name, entry in entries.items():
        section = "links" if name in linked else "deviations"
        with problems.noting(f"[{section}] {name}", entry):
            keys = keys_of(entry)
            members = expand(name, [*parts])
            cost = keys.get("cost")
            if any(key in keys for key in REMEDY_KEYS):  # seldom
                from tolstat.study.remedy_keys import check_remedy_keys

                check_remedy_keys(keys, {name: parts[name] for name in members})
            for key in ("cost", *REMEDY_KEYS):
                keys.pop(key, None)
            batch = _batch(name, keys.pop("common", None), members)
            within = keys.pop(MEAN_WITHIN, None)
            readers = {member: DeviationReader(parts[member]) for member in members}
            for member, reader in readers.items():
                if member in distributions:
                    raise ModelError(f"{member} is given twice")
                if "data" in keys:  # few studies read files
                    from tolstat.study.measured_parts import read_parts

                    parts_of = read_parts(keys, reader, folder)
                    distribution, unit, fit, read.measured[member] = parts_of
                else:
                    distribution, fit = read_distribution(keys, reader), ""
                    unit = written_unit(keys, reader)
                distributions[member], read.entries[member] = distribution, name
                if unit:
                    read.units[member] = unit
                if batch:
                    batches[member] = batch
                if reader.is_sized(keys):
                    read.sized.add(member)
                read.words[member] = _in_words(keys, fit, batch)
                if within is not None:
                    read.means[member] = _range_of_mean(within, reader, distribution)
                    read.words[member] += f", mean within {within}"
            if cost is not None:
                from tolstat.study.cost_entry import read_costs  # for `allocate`

                costs = read_costs(name, cost, keys, readers, distributions)
                read.priced.extend(costs)
            for reader in readers.values():
                read.warnings.update(dict.fromkeys(reader.warnings))
                read.notes.extend(reader.notes)
    pairs = _pairs(correlations, [*parts], distributions, batches, problems)
    noted = [*pairs.items()][:MOST_NOTED]
    read.notes.extend(_noted(pair, typed, distributions) for pair, typed in noted)
    ranks = {pair: typed.rank for pair, typed in pairs.items()}
    return replace(read, dependence=Dependence(batches, ranks))


def _noted(
    pair: tuple[str, str], typed: Typed, distributions: Mapping[str, Distribution]
) -> str:
    """Return a correlation by both kinds, the one that was typed first."""
    a, b = pair
    rank, pearson = f"rank correlation {typed.rank:.4g}", "Pearson's correlation"
    if typed.pearson is not None:
        return f"{a} and {b}: {pearson} {typed.pearson:.4g}, {rank}"
    linear = pearson_of_rank(typed.rank, distributions[a], distributions[b])
    return f"{a} and {b}: {rank}, {pearson} {linear:.4g}"


def _in_words(keys: Mapping[str, Any], fitted: str, batch: Batch | None) -> str:
    """Return a distribution in words: its kind, its keys as written, its fit."""
    rest = dict(keys)
    if "data" in rest:
        kind = f"{rest.pop('fit')} fitted to" if "fit" in rest else "as measured in"
        kind += f" {rest.pop('data')}"
    else:
        kind = str(rest.pop("distribution", DEFAULT)).replace("_", " ")
    typed = "tolerance" in rest and "data" not in keys  # else it is of the drawing
    zone = [str(rest.pop("tolerance"))] if typed else []
    if kind == DEFAULT and not {"cp", "cpk", "sigma"} & set(rest):
        rest["cp"] = 1
    words = [kind, *zone, *(f"{key} {as_typed(value)}" for key, value in rest.items())]
    if fitted:
        words.append(fitted)
    if batch:
        words.append(
            "all parts alike"
            if batch.share == 1
            else f"{100 * batch.share:g} % of the variance common to all"
        )
    return ", ".join(words)


def _range_of_mean(
    within: Any, reader: DeviationReader, distribution: Distribution
) -> Tolerance:
    """Read the key `mean_within`."""
    if not isinstance(within, str):
        raise DistributionError(
            f'{MEAN_WITHIN}: a text such as "+-0.01 mm" is expected'
        )
    if isinstance(distribution, Constant):
        raise DistributionError(f"a constant has no mean that moves; no {MEAN_WITHIN}")
    zone = reader.zone(within)
    if not zone.lower <= 0 <= zone.upper:
        raise DistributionError(
            f"{MEAN_WITHIN} = {within}: a range about the mean is expected, such as "
            '"+-0.01 mm"'
        )
    return zone


def _batch(name: str, common: Any, members: list[str]) -> Batch | None:
    """Read the key `common`."""
    if common is None or common is False:
        return None
    if not isinstance(common, int | float) or not 0 < common <= 1:
        raise DependenceError(
            "common: true is expected (all parts are equal), or the common share of "
            "the variance of a batch, above 0 and at most 1"
        )
    if len(members) < 2:
        raise DependenceError(f"common needs several parts; {name} is one part")
    return Batch(name, float(common))


def _pairs(
    correlations: Correlations,
    names: list[str],
    distributions: Mapping[str, Distribution],
    batches: Mapping[str, Batch],
    problems: Problems,
) -> dict[tuple[str, str], Typed]:
    """Read the section [correlation]: Pearson's depend on the distributions."""
    pairs: dict[tuple[str, str], Typed] = {}
    for name, partners in correlations.items():
        with problems.noting(f"[correlation] {name}", partners):
            firsts = expand(name, names)
            for other, correlation in partners.items():
                seconds = expand(other, names)
                for member in (*firsts, *seconds):
                    _check_deviates(member, distributions, batches)
                typed, linear = _kind_of(correlation)
                same = firsts == seconds and len(firsts) > 1
                both = combinations(firsts, 2) if same else product(firsts, seconds)
                for first, second in both:
                    if first == second:
                        raise DependenceError(f"{first} is correlated with itself")
                    if (first, second) in pairs or (second, first) in pairs:
                        raise DependenceError(f"{first} with {second} is given twice")
                    of_pair = (distributions[first], distributions[second])
                    rank = rank_of_pearson(typed, *of_pair) if linear else typed
                    pairs[first, second] = Typed(rank, typed if linear else None)
    ranks = {pair: typed.rank for pair, typed in pairs.items()}
    for group in groups(ranks):
        with problems.noting("[correlation]", None):
            correlation_of_scores(group, Dependence({}, ranks))
    return pairs


def _kind_of(correlation: float | Mapping[str, float]) -> tuple[float, bool]:
    """Return a correlation as typed, and whether it is Pearson's."""
    typed: Any = correlation
    linear = False
    if isinstance(correlation, Mapping):
        entry = read_entry(CorrelationEntry, correlation, "a correlation has")
        if (entry.pearson is None) == (entry.spearman is None):
            raise DependenceError(
                "either { pearson = ... } or { spearman = ... } (of ranks) is "
                "expected, one of both"
            )
        linear = entry.spearman is None
        typed = entry.pearson if linear else entry.spearman
    if not -1 < typed < 1:
        kind = "Pearson" if linear else "rank"
        raise DependenceError(
            f"{kind} correlation {typed:g}: a number between -1 and 1 is expected, "
            "both excluded; for equal parts give common = true"
        )
    return typed, linear


def _check_deviates(
    name: str, distributions: Mapping[str, Distribution], batches: Mapping[str, Batch]
) -> None:
    if isinstance(distributions.get(name), Constant | None):
        raise DependenceError(f"{name} does not deviate; add it to [deviations]")
    if name in batches:
        raise DependenceError(
            f"{name} belongs to a batch; give common or a correlation, not both"
        )
