"""The cheapest tolerances that meet all limits: weighting finds, fresh runs prove."""

import math
from concurrent.futures import Executor
from numbers import Integral
from typing import NamedTuple

import numpy as np

from tolstat.answers.allocate import search as searching
from tolstat.answers.allocate.allocation import AllocatedEntry, Allocation, Role
from tolstat.answers.allocate.fresh_runs import LONGEST, FreshRuns
from tolstat.answers.allocate.linear_schemes import linear_choices, means_off_limit
from tolstat.answers.allocate.search import Search
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.errors import DistributionError, StudyError
from tolstat.execution.planning import measured_samples
from tolstat.execution.run_loop import Progress, Telling
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.contract import Model
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.sample_size import fewest_trials
from tolstat.study.cost_entry import EXAMPLE
from tolstat.study.memory_needed import too_large
from tolstat.study.study import Source, Study, load

ENOUGH = 50  # out-of-limit trials at the permitted fraction
LONGER = 32  # times as many trials, for a longer proof where the cost is worth it
QUICK, MANY = 256, 2_000_000  # where nothing is integrated, up to so many trials


def allocate(
    study: Source,
    *,
    trials: int | None = None,
    workers: int | None = None,
    model: Model | None = None,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Allocation:
    """Return the cheapest tolerances with which a study meets all its limits.

    Parameters
    ----------
    study : path or mapping
        A study file or its content; entries of [deviations] have a `cost`.
    trials : int, optional
        Of the wide run, and of each proof at its first look; else as many as the
        strictest limit needs, or as the study has if these are more.
    workers, model, progress, executor
        As of `tolstat.run`.

    Returns
    -------
    Allocation
        `.study_file()` is the study with these tolerances. Nothing is stored.

    Raises
    ------
    StudyError
        If the study is wrong, samples nothing, has no limit or no cost.
    """
    loaded = load(study, model=model)
    with Workers(workers, executor=executor) as crew:
        return allocated(loaded, crew, trials=trials, progress=progress)


def allocated(
    study: Study,
    workers: Workers,
    *,
    trials: int | None = None,
    progress: Telling | None = None,
) -> Allocation:
    """Return the allocated tolerances of a checked study; see `allocate`."""
    _check(study)
    lengths = _lengths(study, trials)
    tell = progress or (lambda progress: None)
    tell(Progress(0, 0, lengths.first, warning=lengths.words))
    return _answer(Search(FreshRuns(study, workers, lengths.first, tell)), lengths)


class _Lengths(NamedTuple):
    """Trials of a first look, of the longest proof, and these in words."""

    first: int
    longest: int
    words: str


def _lengths(study: Study, trials: int | None) -> _Lengths:
    """Return the numbers of trials; refuse too many, and too few for a proof."""
    if trials is not None and not (isinstance(trials, Integral) and trials > 0):
        raise StudyError(f"trials: a whole number from 1 is expected, not {trials}")
    source = study.path or "the study"
    strictest = max(study.limits, key=lambda name: study.limits[name].demanded)
    share = 1 - study.limits[strictest].demanded
    enough = math.ceil(ENOUGH / share)
    first = trials or max(study.trials, enough)
    most = LONGEST * first
    if wrong := too_large(most, study.description):
        raise StudyError(
            f"{source}: a proof may take {LONGEST} times {first} trials: {wrong}; give "
            "fewer trials, or lower the demanded yields"
        )
    longest = LONGER * min(first, enough)
    if not study.model.integrates:
        longest = max(longest, min(QUICK * min(first, enough), MANY))
    longest = max(most, longest)
    if too_large(longest, study.description):
        longest = most  # an answer does without
    permits = f"{strictest} permits {1e6 * share:.6g} ppm out of limit"
    least = fewest_trials(share, LONGEST)
    if anytime_valid(0, most).upper > share:  # with none out of limit
        raise StudyError(
            f"{source}: {permits}. No first proof of {most} trials, {LONGEST} times "
            f"those requested, can show that: give {least} trials or more"
        )
    words = (
        f"{permits}: the wide run and each fresh run have {first} trials, a proof up "
        f"to {most}"
    )
    if longest > most:
        words += f", or {longest} where the cost is worth it"
    if first > study.trials and not trials:
        words += f" (fewer trials may be requested, {least} at least)"
    return _Lengths(first, longest, words)


def _check(study: Study) -> None:
    """Refuse a study that has no limit or cost, or cannot be weighted."""
    source = study.path or "the study"
    if study.points:
        raise StudyError(
            f'{source}: sampling = "{study.sampling}" samples nothing; allocation '
            'needs sampled trials, such as sampling = "random"'
        )
    if not study.limits:
        raise StudyError(
            f"{source} has no [limits]: without them the loosest tolerances are the "
            "cheapest; add limits and their demanded yields"
        )
    deviating = study.deviating
    if not deviating.priced:
        raise StudyError(
            f"{source}: no entry of [deviations] or [links] has a cost; give one or "
            f"more of them cost = {EXAMPLE}"
        )
    nowhere = {name: np.zeros(1) for name in deviating.distributions}
    for entry in deviating.priced:
        tightest, loosest = map(entry.distributions, entry.ends)
        sampled = {**deviating.distributions, **loosest}
        try:
            DensityRatio(nowhere, sampled, deviating.dependence).weights(tightest)
        except DistributionError as error:
            raise StudyError(
                f"{source}: {entry.name} has a cost, but cannot be weighted: {error}; "
                "leave its cost out, or give it another distribution"
            ) from None


def _answer(search: Search, lengths: _Lengths) -> Allocation:
    """Find the cheapest tolerances, prove them, and compare them with others."""
    runs, study = search.runs, search.runs.study
    linear, omitted = linear_choices(search)  # the wide run lies about its shifts
    search.run_wide()
    proof = search.proved()
    ways = [*([proof.choice] if proof else []), *linear.values()]
    proof = search.stretched(ways, proof, lengths.longest)
    # this seed chooses nothing; a proof is chosen from several runs
    seed = search.next_seed()
    proof = (
        proof
        or search.at_tightest
        or runs.prove(search.tightest, search.next_seed(), most=runs.longest)
    )
    choice, scheme = proof.choice, proof.scheme
    proofs = {Role.DRAWING: runs.prove(search.specified, seed)}
    name = Role.FOUND if proof.met else Role.TIGHTEST
    proofs[name] = runs.prove(choice, seed) if proof.met else proof
    points = searching.points_about(search, choice)
    if proof.met:
        proofs[Role.EQUAL_COST] = searching.at_equal_cost(search, points, seed)
    proofs |= {name: runs.prove(other, seed) for name, other in linear.items()}
    listed = all(entry.offered for entry in search.priced)
    chosen = zip(search.priced, search.specified, choice, strict=True)
    entries = tuple(
        AllocatedEntry(
            entry.name, len(entry.specified),
            specified=entry.text(before), found=entry.text(x),
            cost_specified=entry.cost(before), cost=entry.cost(x),
            at_loosest=search.at_loosest(i, x),
        )
        for i, (entry, before, x) in enumerate(chosen)
    )  # fmt: skip
    if listed:
        points = searching.own_fractions(search, points)
    return Allocation(
        cost=scheme.cost,
        half_widths=scheme.half_widths,
        met=proof.met,
        entries=entries,
        schemes={name: other.scheme for name, other in proofs.items()},
        omitted_schemes=omitted,
        proof=scheme,
        verdicts={name: limit.verdict for name, limit in proof.yields.items()},
        active_limits=search.active_limits(choice),
        exhaustive=search.exhaustive,
        wide_trials=search.wide_trials,
        fresh_trials=runs.lengths,
        trade_off=tuple(sorted(points, key=lambda p: p.fraction_out_of_any_limit)),
        off_limit={} if proof.met else dict(means_off_limit(runs, proof)),
        measured={x.name: x.parts for x in measured_samples(study.deviating)},
        title=study.title,
        study=runs.study_text(
            choice, trials=scheme.trials, seed=scheme.seed, sampling="random"
        ),
        listed=listed,
        integrates=study.model.integrates,
    )
