"""How many trials decide whether a limit is met."""

import math
from bisect import bisect_left

import numpy as np
from scipy.special import bdtr, betaincinv, ndtr

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import CONFIDENCE
from tolstat.statistics.intervals.replicates import (
    LEAST_IN_EACH,
    half_width,
    missing,
    never_met,
)
from tolstat.statistics.intervals.shares import PRIOR, anytime_valid, evidence_against

CHANCE = 0.8  # that the printed number of trials decides
GROWTH = 1.25  # ratio of successive numbers of trials that are tried
MOST_TRIALS = 10**9
POSTERIOR = 200  # shares that represent the posterior


def trials_that_decide(count: int, trials: int, share: float) -> int:
    """Return how many trials decide whether a property is rarer than a share.

    The least number, in steps of a quarter, that decides with a chance of 80 % over
    Jeffreys' posterior. At this number the property can be found rarer. 0 above 1e9.
    Arguments as of `anytime_valid`.
    """
    evidence = math.log(2 / (1 - CONFIDENCE))
    a, b = count + PRIOR, trials - count + PRIOR
    possible = betaincinv(a, b, (np.arange(POSTERIOR) + 0.5) / POSTERIOR)

    def decides(growth: int) -> bool:
        n = grown(trials * GROWTH**growth)
        fewest, most = _deciding(n, share, evidence)
        if fewest < count:  # not met even if no further unit is out of limit
            return False
        rarer = _at_most(fewest - count, n - trials, possible)
        oftener = 1 - _at_most(most - count - 1, n - trials, possible)
        return float(np.mean(rarer + oftener)) >= CHANCE

    most = math.ceil(math.log(MOST_TRIALS / trials, GROWTH))
    growth = 1 + bisect_left(range(1, most + 1), True, key=decides)
    return grown(trials * GROWTH**growth) if growth <= most else 0


def trials_enough(count: int, trials: int, share: float, planned: int) -> int:
    """Return how many trials are likely to decide: `planned` if these do, else more.

    They do if they decide with as large a part out of limit as `count` of `trials`.
    Arguments and more as of `trials_that_decide`.
    """
    likely = anytime_valid(round(count / trials * planned), planned)
    if likely.upper <= share or likely.lower > share:
        return planned
    return max(planned, trials_that_decide(count, trials, share))


def fewest_trials(share: float, times: int = 1) -> int:
    """Return how many trials show that a property is rarer than a share, without one.

    The least number, to two digits, of which so many times as many do.
    """
    fewest = 1
    while (upper := anytime_valid(0, times * fewest).upper) > share:
        fewest = grown(fewest * upper / share)
    return fewest


def replicates_that_decide(units: Truths, replicate: Integers, demanded: float) -> int:
    """Return how many trials decide whether a share is as large as demanded.

    The least number, in steps of a quarter, that decides with a chance of 80 %; 0 above
    1e9. The scatter of replicates is assumed to fall with the root of the trials. If
    replicates are too small, the number that makes them large enough. Arguments as of
    `share_from_replicates`.
    """
    values = units.astype(np.float64)
    if missing(values, replicate):
        return grown(LEAST_IN_EACH * max(int(replicate.max(initial=0)) + 1, 2))
    share, n = float(values.mean()), len(values)
    shares = np.bincount(replicate, values) / np.bincount(replicate)
    half = half_width(shares)
    error = float(shares.std(ddof=1)) / math.sqrt(len(shares))
    rare = never_met(n, len(shares))
    trials = n
    while (trials := math.ceil(GROWTH * trials)) <= MOST_TRIALS:
        part = n / trials
        wide, beyond = half * math.sqrt(part), rare * part
        # the later estimate differs from the present one, and from the truth
        scatter = max(error * math.sqrt(1 + part), 1e-12)
        met = ndtr((share - wide - beyond * share - demanded) / scatter)
        missed = ndtr((demanded - share - wide - beyond * (1 - share)) / scatter)
        if met + missed >= CHANCE:
            return grown(trials)
    return 0


def grown(n: float) -> int:
    """Round a number of trials up to two digits."""
    unit: int = 10 ** max(math.floor(math.log10(n)) - 1, 0)
    return unit * math.ceil(n / unit)


def _deciding(trials: int, share: float, evidence: float) -> tuple[int, int]:
    """Return the largest count that meets a share, and the least that misses it."""
    middle = math.floor(share * trials) + 1

    def rarer(count: int) -> bool:
        return evidence_against(count, trials, share) >= evidence

    def oftener(count: int) -> bool:
        return evidence_against(trials - count, trials, 1 - share) >= evidence

    to, beyond = range(middle), range(middle, trials + 1)
    fewest = bisect_left(to, True, key=lambda count: not rarer(count)) - 1
    return fewest, middle + bisect_left(beyond, True, key=oftener)


def _at_most(count: int, trials: int, shares: Array) -> Array:
    """Return the probabilities of at most `count` of `trials`, at shares."""
    if count < 0:
        return np.zeros_like(shares)
    return np.asarray(bdtr(min(count, trials), trials, shares))
