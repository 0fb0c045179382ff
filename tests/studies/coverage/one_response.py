"""Intervals of one response: independent trials, replicates, stopping rules."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import ndtr, ndtri

from tests.studies.coverage.problems import PROBLEMS, SIZES, limit_of, simulated
from tolstat.deviations.samplers import REPLICATES, Latin, Sobol
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.intervals.shares import anytime_valid, proportion
from tolstat.statistics.limits.limit import Limit, ppk_of
from tolstat.statistics.point_mass import point_mass_of
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at
from tolstat.statistics.sample_size import (
    FIRST_STAGE,
    Precision,
    Statistic,
    next_stage,
    trials_that_decide,
    trials_wanted,
)
from tolstat.statistics.summary import (
    QUANTILES,
    by_moments,
    by_percentiles,
    by_share,
    summarize,
)
from tolstat.status import Status

SIMULATED = (
    "khpt75, rod_force_1", "khpt75, rod_force_2", "khpt75, extra_loss",
    "rods +-0.9 mm, extra_loss", "rods +-0.9 mm, jam_share",
)  # fmt: skip
EVERY = (*PROBLEMS, *SIMULATED)
FAILED = 0.004  # share of the machines that fail: those of the largest response
MEANT = {True: "of a share", False: "within reach"}


def problem_of(name):
    """Return a problem, simulated once where no formula says what it is."""
    return PROBLEMS[name] if name in PROBLEMS else simulated()[name]


@cache
def truths(name):
    """Return the true value of each statistic, and the limit that some refer to."""
    problem = problem_of(name)
    end = limit_of(problem)
    limit = Limit(-np.inf, end)
    found = {f"quantile {share:g}": problem.quantile(share) for share in QUANTILES}
    beyond = float(1 - problem.cdf(end))
    middle, far = problem.quantile(0.5), problem.quantile(0.99865)
    found["share beyond"] = beyond
    found["Ppk by share"] = ppk_of(beyond, 1)
    found["Ppk by percentiles"] = (end - middle) / (far - middle) if far > middle else 0
    found["mean"], found["sigma"] = problem.mean, problem.sigma
    found["mean as printed"], found["sigma as printed"] = problem.mean, problem.sigma
    found["Ppk by moments"] = (end - problem.mean) / (3 * problem.sigma)
    return found, limit


def estimates(values, sample, problem, limit):
    """Estimate all of them, as a report does."""
    found = {
        f"quantile {share:g}": each
        for share, each in quantiles_at(
            values, sample, QUANTILES, limit.permitted
        ).items()
    }
    beyond = share(values > limit.upper, sample)  # as a verdict has it
    found["share beyond"], found["Ppk by share"] = beyond, by_share(beyond, limit)
    found["Ppk by percentiles"] = by_percentiles(values, sample, limit).ppk
    reach = Reach(problem.ends, limit.permitted)
    wide = for_any(values, sample, reach)
    found["mean"], found["sigma"] = wide
    printed = as_sampled(values, sample).otherwise(wide)
    found["mean as printed"], found["sigma as printed"] = printed
    found["Ppk by moments"] = by_moments(values, sample, limit, problem.ends).ppk
    return found


def share(machines, sample):
    """Estimate a share as `statistics.limits.yields` does, without its verdict."""
    if sample.replicates:
        return share_from_replicates(machines, sample.replicate)
    return anytime_valid(int(machines.sum()), len(machines))


def exactly(statistic):
    """Tell whether an interval is exact: it holds whatever the response is like."""
    return statistic.startswith(("quantile", "share", "Ppk by share", "Ppk by perc"))


def intervals(name, rng, size):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    problem, (known, limit) = problem_of(name), truths(name)
    x = problem.draw(rng, size)
    sample = Sample(np.full(size, Status.DONE))
    for each, found in estimates(x, sample, problem, limit).items():
        if not claimed(name, each, size):
            continue
        exact = exactly(each) or (problem.ends is not None and each == "mean")
        words = f"{each} {MEANT[problem.ends is not None]}" if each in MOMENTS else each
        yield name, words, found, known[each], exact
    alike = float(problem.cdf(0.0) - problem.cdf(-1e-9))
    atom = point_mass_of(x) if alike > 0.5 else None
    if atom and atom.largest == 0.0:
        yield name, "share of an atom", atom.share, alike, True


MOMENTS = ("mean", "sigma")  # for any distribution
# share of a kind of machine that may be missing among many others
RARER = {"2 in 1000 of another kind": 0.002, "3 in 400 jam, others nearly none": 0.0075}
LEAST_SEEN = 5  # expected machines from which it is no rarer kind than those seen


def claimed(name, statistic, size):
    """Tell whether a problem is in the class of a statistic: trials as sampled."""
    seen = RARER.get(name, 1.0) * size >= LEAST_SEEN
    return seen or not ("as printed" in statistic or "by moments" in statistic)


def failing(name, rng, size):
    """Yield quantiles where the machines of the largest response fail."""
    problem, (known, limit) = problem_of(name), truths(name)
    x = problem.draw(rng, size)
    status = np.full(size, Status.DONE)
    status[x > problem.quantile(1 - FAILED)] = Status.NOT_FINITE
    sample = Sample(status)
    x[status != Status.DONE] = np.nan
    for words, permitted in (("of a limit", limit.permitted), ("of no limit", None)):
        for share, found in quantiles_at(x, sample, QUANTILES, permitted).items():
            each = f"quantile {share:g}"
            yield name, f"{each}, some fail, {words}", found, known[each], True


TWO_ENDED = ("normal", "lognormal", "Student t4", "2 in 1000 of another kind")
BELOW, ABOVE = 0.001, 0.003  # shares of the machines beyond either end


def between(name, rng, size):
    """Yield what is said of a limit with two ends."""
    problem = problem_of(name)
    lower, upper = problem.quantile(BELOW), problem.quantile(1 - ABOVE)
    low, middle, high = map(problem.quantile, (0.00135, 0.5, 0.99865))
    limit = Limit(lower, upper)
    apart = min(upper - problem.mean, problem.mean - lower)
    known = {
        "share beyond": BELOW + ABOVE,
        "Ppk by share": ppk_of(BELOW + ABOVE, 2),
        "Pp by percentiles": (upper - lower) / (high - low),
        "Ppk by percentiles": min(
            (upper - middle) / (high - middle), (middle - lower) / (middle - low)
        ),
        "Pp by moments": (upper - lower) / (6 * problem.sigma),
        "Ppk by moments": apart / (3 * problem.sigma),
    }
    x, sample = problem.draw(rng, size), Sample(np.full(size, Status.DONE))
    beyond = share((x < lower) | (x > upper), sample)
    by = {
        "percentiles": by_percentiles(x, sample, limit),
        "moments": by_moments(x, sample, limit, problem.ends),
    }
    found = {"share beyond": beyond, "Ppk by share": by_share(beyond, limit)}
    found |= {f"Pp by {words}": each.pp for words, each in by.items()}
    found |= {f"Ppk by {words}": each.ppk for words, each in by.items()}
    for each, estimate in found.items():
        exact = not each.endswith("moments")
        if not claimed(name, each, size):
            continue
        yield name, f"{each}, two ends", estimate, known[each], exact


DIFFER = "1 in 20 differs in two designs"


def differing(name, rng, size):
    """Yield what is said of the difference of two designs, machine by machine."""
    problem, (known, _) = problem_of(name), truths(name)
    x, sample = problem.draw(rng, size), Sample(np.full(size, Status.DONE))
    found = summarize(x, sample)
    for share, each in found.quantiles.items():
        truth = known[f"quantile {share:g}"]
        yield name, f"quantile {share:g} of a difference", each, truth, True
    yield name, "mean of a difference", found.mean, problem.mean, False
    yield name, "sigma of a difference", found.sigma, problem.sigma, False
    smaller = proportion(int((x < 0).sum()), size)
    yield name, "share of smaller ones", smaller, float(problem.cdf(-1e-12)), True


MOST = 65_536  # trials that a rule may have


def until_mean(name, rng, size):
    """Yield the interval with which a stopping rule ends, if it is reached."""
    found = _until(Statistic("y", "mean"), 0.2, problem_of(name), rng, size)
    yield name, "mean until +-20 %", found, problem_of(name).mean, False


def until_quantile(name, rng, size):
    """Yield the same of a quantile."""
    problem = problem_of(name)
    found = _until(Statistic("y", "quantile", 0.95), 0.05, problem, rng, size)
    yield name, "quantile 0.95 until +-5 %", found, problem.quantile(0.95), False


def _until(statistic, within, problem, rng, over):
    """Follow a rule to its end; no interval if it is not reached, and says so."""
    ranges = {"y": problem.ends} if problem.ends else {}
    rule, x, wanted = Precision(statistic, within, True), np.empty(0), 1.0
    while wanted and len(x) < MOST:
        x = np.concatenate([x, problem.draw(rng, over - len(x))])
        sample = Sample(np.full(len(x), Status.DONE))
        wanted = trials_wanted([rule], {"y": x}, sample, {}, ranges)
        over = min(next_stage(len(x), wanted), MOST) if wanted else over
    found = statistic.estimate(x, sample, declared=problem.ends)
    return found._replace(lower=np.nan, upper=np.nan) if wanted else found


DEMANDED = 0.0027  # share beyond, at the very bar of the verdict
FOLLOWED = 10**6  # trials after which nobody looks any more


def followed_verdict(_, rng, size):
    """Yield the last interval of a verdict that was followed until it fell."""
    n, count = size, rng.binomial(size, DEMANDED)
    while True:
        found = anytime_valid(count, n)
        if not found.lower <= DEMANDED <= found.upper or n > FOLLOWED:
            break
        more = trials_that_decide(count, n, DEMANDED) or 10 * FOLLOWED
        more = min(more, 2 * FOLLOWED)
        count, n = count + rng.binomial(more - n, DEMANDED), more
    yield "at the bar", "share beyond, followed until decided", found, DEMANDED, True


def replicated(_, rng, size):
    """Yield intervals of Latin hypercube and Sobol' trials, for all problems."""
    streams = {"a": 0, "b": 1, "c": 2}
    sample = Sample(np.full(size, Status.DONE), REPLICATES)
    for sampler in (Latin(), Sobol()):
        parts = sampler.unit_samples(int(rng.integers(2**62)), streams, size)
        u = ndtr(ndtri(parts).sum(axis=1) / np.sqrt(3))
        sampling = type(sampler).__name__.lower()
        for name, unit, words in (
            *((each, u, sampling) for each in EVERY),
            ("normal", parts[:, 0], f"{sampling}, of one part"),
        ):
            problem, (known, limit) = problem_of(name), truths(name)
            y = problem.inverse(unit)
            for each, found in estimates(y, sample, problem, limit).items():
                if claimed(name, each, size):
                    yield name, f"{each}, {words}", found, known[each], False


STUDIES = 1000
JOBS = (
    [(name, size, intervals, STUDIES) for name in EVERY for size in SIZES]
    + [(n, size, failing, STUDIES) for n in ("normal", "lognormal") for size in SIZES]
    + [(name, size, between, STUDIES) for name in TWO_ENDED for size in SIZES]
    + [(DIFFER, size, differing, STUDIES) for size in SIZES]
    + [(name, FIRST_STAGE, until_mean, STUDIES) for name in EVERY]
    + [(name, FIRST_STAGE, until_quantile, 4 * STUDIES) for name in EVERY]
    + [("at the bar", size, followed_verdict, STUDIES) for size in (200, 1000)]
    + [("replicates", FIRST_STAGE, replicated, STUDIES)]
    + [("replicates", 10_000, replicated, STUDIES // 2)]
)
