"""Rare-event sampling: trials out of limit are searched in stages, then weighted."""

from collections.abc import Generator, Mapping
from types import MappingProxyType

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations import rare_stage
from tolstat.deviations.likely_points import MOST, likely_points, study_around
from tolstat.deviations.mixture import centred
from tolstat.deviations.rare_search import (
    FOR_MOVES,
    FOR_STAGES,
    SPREADS,
    Search,
    in_equal_numbers,
)
from tolstat.deviations.samplers import Sampler
from tolstat.deviations.subset_simulation import approach

LEAST_TRIALS, ENOUGH = 5000, 20_000  # least number of a run; a number that is enough
MANY, MANY_OF_KINDS = 16, 36  # directions that are many: of one kind, of several
# shares of the trials: of the first stage; of each step of subset simulation, and with
# many directions; at most, of the moves to likely points
FIRST, STEP, STEP_OF_MANY, LED = 0.1, 0.01, 0.02, 0.25
LEAST_OF_STEP = 100  # trials
REACHED = 0.64  # points per start, below which the trials came together at points
LAST = 0.1  # least share of the last stage
# shares of the trials that start to likely points, fewer to move more often; share of
# these that comes from subset simulation
STARTS, STARTS_OF_MANY, SURVIVORS = 0.02, 0.01, 1 / 8


class Rare(Sampler):
    """Importance sampling from a mixture that earlier stages have found.

    It works in the space of independent normal scores. The first stage, a tenth of the
    trials, has 1.5 to 4 times the spread of the study; in a few directions it reaches
    ten sigmas. `approach` follows the response towards the limit. `likely_points` moves
    the out-of-limit trials of both towards the median trial, to the most probable
    points of each kind.

    Each of five stages samples about these points, and from a mixture of normal
    distributions fitted to the weighted out-of-limit trials of the stages before. With
    16 directions or more, or 36 if there are several points, moves of Markov chains
    replace the five stages (`relaxed`). They distribute trials about the points as
    out-of-limit trials of the study; one mixture is fitted to these. If there are
    several points, or too few such trials, those of subset simulation are moved and
    fitted, too.

    The last stage samples from the last fit. A tenth comes from the study, nearly a
    twentieth from twice its spread. Only these weighted trials estimate the fraction;
    the tenth as in the study bounds the rest.

    A sample depends on the seed, the number of trials, the names and earlier responses.

    References
    ----------
    N. Kurtz, J. Song, Cross-entropy-based adaptive importance sampling using Gaussian
    mixture, Structural Safety 42 (2013) 35-44. J.-M. Cornuet et al., Adaptive multiple
    importance sampling, Scand. J. Statist. 39 (2012) 798-812. K. Breitung, The geometry
    of limit state function graphs and subset simulation: counterexamples, Reliability
    Engineering and System Safety 182 (2019) 98-106: why the response alone must not
    lead to the trials out of limit.
    """

    sample = False
    aims = True
    columns = MappingProxyType(
        {
            rare_stage.STAGE: "stage that the trial belongs to; NaN before it is drawn",
            rare_stage.SPREAD: "times the spread of the study that the stage aimed at",
            rare_stage.DISTANCE: "distance from the middle trial, in normal scores",
            rare_stage.WEIGHT: "density in the study over that in the stage; NaN where "
            "sought",
        }
    )
    promise = (
        "trials out of limit were sought in stages; the last stage, independent "
        "weighted trials, tells the fraction out of limit, with a gamma interval"
    )

    def unfit(self, trials: int, factors: int) -> str:
        """Return why a number of trials does not fit."""
        if not factors:
            return (
                "nothing deviates: no machine is rare; give a line in [deviations], "
                'such as rod_length = "+-1.2 mm", or a link its tolerance'
            )
        if trials < LEAST_TRIALS:
            return (
                f'sampling = "rare" needs {LEAST_TRIALS} trials or more: most of them '
                f"are to find trials out of limit; {ENOUGH} are plenty"
            )
        return ""

    def usual_trials(self, factors: int) -> int:
        """Return a number of trials that is enough for search and estimate."""
        return ENOUGH

    def warnings(self, trials: int, factors: int) -> tuple[str, ...]:
        """Return warnings that a number of trials may be too small."""
        if trials >= ENOUGH:
            return ()
        return (
            f"use trials = {ENOUGH} or more: with {trials} the search may miss a small "
            "kind of out-of-limit trials, and the interval does not include it",
        )

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[rare_stage.RareStage, Array, None]:
        """Yield stages; the arguments are as of `Sampler.stages`."""
        search, directions = Search(seed, streams, trials), len(streams)
        is_large = directions >= MANY
        yield from search.stage(centred(SPREADS, directions), FIRST)
        step = max(round((STEP_OF_MANY if is_large else STEP) * trials), LEAST_OF_STEP)
        halves = yield from search.counted(approach(seed, streams, step))
        survivors, failures = np.concatenate(halves), search.out_of_limit
        number = round((STARTS_OF_MANY if is_large else STARTS) * trials)
        from_survivors = min(round(SURVIVORS * number), len(survivors))
        others = min(number - from_survivors, len(failures))
        starts = (
            in_equal_numbers(failures, others),
            in_equal_numbers(survivors, from_survivors),
        )
        # enough trials stay for the later stages
        after = round((LAST + (FOR_MOVES if is_large else FOR_STAGES)) * trials)
        led = min(round(LED * trials), search.left - after)
        points = yield from search.counted(
            likely_points(seed, streams, np.concatenate(starts), led)
        )
        mixture = centred(np.ones(1), directions)  # if no response leads out of limit
        if len(points):
            centres, reached = (
                study_around(points),
                len(points) < min(MOST, REACHED * number),
            )
            kinds = reached and len(points) > 1
            if directions >= (MANY_OF_KINDS if kinds else MANY):
                mixture = yield from search.at_once(centres, halves, reached=reached)
            else:
                mixture = yield from search.in_stages(centres, halves)
        yield from search.last_stage(mixture)
