"""Stages of random trials of which mainly uncertain ones are evaluated.

The trials of a study go on where its plain stage ended. Surfaces fitted to the
evaluated ones choose the chance of each: see `chances`. The verdict does not rest on
them: see `Thinned`.
"""

from dataclasses import replace

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.samplers import uniform
from tolstat.execution.stages import SampledStages, Stage, Trials
from tolstat.statistics.deciding.chances import (
    Chances,
    Ranking,
    chances,
    near_chances,
    out_of_limit,
)
from tolstat.statistics.deciding.looks import undecided
from tolstat.statistics.intervals.weights import COLUMNS, RARE
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.sample import Sample
from tolstat.status import ran_in_order
from tolstat.study.study import Study

AT_ONCE = 8192  # trials drawn at once
LARGER = 0.07  # part of the evaluated trials that a stage adds
LEAST, MOST_DRAWN = 256, 1_000_000  # evaluated trials of a stage; drawn ones
REFITTED = 1.25  # times as many evaluated trials: surfaces are fitted again


class ThinnedStages:
    """The stages of a study after its first, plain one; each is proposed till its end.

    A stage follows from the answers before, so a resumed run has the same ones.

    Attributes
    ----------
    trials : Trials
        All trials of the study.
    sample : Sample
        Those whose stages have ended, at the last look.
    undecided : dict
        The limits that these leave undecided, with the trials within each of them.
    """

    def __init__(self, study: Study, trials: Trials) -> None:
        self._study, self.trials = study, trials
        self._latest: Stage | None = None
        self._rankings, self._fitted = dict[str, Ranking](), 0
        self.sample = Sample(np.empty(0, np.uint8))
        self.undecided = dict[str, Truths]()

    @classmethod
    def of_run(cls, study: Study) -> "ThinnedStages":
        """Return the stages of a study whose first stage is known."""
        trials = SampledStages(replace(study, trials=study.thinned)).trials
        trials.make_room(study.trials)
        trials.thin(study.thinned)
        return cls(study, trials)

    def next(self, trials: Trials) -> Stage | None:
        """Return the latest stage while it is not over, then another one.

        None if all limits are decided, or a fixed number of trials is reached.
        """
        latest = self._latest
        rows = slice(latest.first, latest.stop) if latest else slice(trials.sampled)
        if latest and latest.stop > len(trials.status):
            return latest
        if not trials.status[rows].all():
            first = Stage(0, trials.deviations[rows], self._study.cases)
            return latest or first
        if trials.sampled == len(trials.status) and not self._study.until:
            return None
        self._look(trials.first(trials.sampled))
        self._latest = self._proposed(trials) if self.undecided else None
        return self._latest

    def look_back(self, trials: Trials) -> None:
        """Look at the trials of the stages that are over; the first one is."""
        assert trials.thinned
        ran = ran_in_order(trials.status[: trials.sampled])
        self._look(trials.first(trials.thinned.in_whole_stages(ran)))

    def _look(self, trials: Trials) -> None:
        self.sample = Sample(trials.status, thinned=trials.thinned)
        responses = trials.by_response()
        self.undecided = undecided(responses, self.sample, self._study.limits)

    def _proposed(self, trials: Trials) -> Stage:
        """Return the next stage: so many drawn trials as give enough to evaluate."""
        chosen, n = self._chances(trials.first(trials.sampled)), trials.sampled
        # trials far from all limits have no chance: the others have 1
        least = max((c.chance.min() for c in chosen), default=1.0) or -1.0
        drawn = int(trials.drawn["thinned-drawn"][n - 1])
        wanted, first, sum_of_chances = max(LEAST, LARGER * n), drawn, 0.0
        deviations, chance, number = list[Array](), list[Array](), 0
        while sum_of_chances < wanted and (drawn - first < MOST_DRAWN or not number):
            rows = self._study.random_trials(drawn, drawn + AT_ONCE)
            chances_of_rows = np.ones(AT_ONCE)
            if chosen:
                chances_of_rows = np.max([c.of_trials(rows) for c in chosen], axis=0)
            sums = sum_of_chances + np.cumsum(chances_of_rows)
            last = min(int(np.searchsorted(sums, wanted)) + 1, AT_ONCE)
            coins = uniform(self._study.seed or 0, "trials", last, "thinned", drawn)
            evaluated = np.flatnonzero(coins < chances_of_rows[:last])
            deviations.append(rows[evaluated])
            chance.append(chances_of_rows[evaluated])
            drawn, sum_of_chances = drawn + last, float(sums[last - 1])
            number += len(evaluated)
        columns = (
            np.concatenate(chance),
            np.full(number, float(drawn)),
            np.full(number, least),
        )
        (case,) = self._study.cases  # random trials have equal settings
        return Stage(
            n,
            np.concatenate(deviations),
            [case._replace(first=n, stop=n + number)],
            dict(zip(COLUMNS, columns, strict=True)),
        )

    def _chances(self, trials: Trials) -> list[Chances]:
        """Return the chances for each undecided limit; none where no surface ranks.

        Once only limits are undecided that permit few, trials far from all of these
        have no chance: such a limit may be met while another one is undecided.
        """
        thinned, n, names = trials.thinned, len(trials.status), [*self.undecided]
        assert thinned
        limits = self._study.limits
        rare = [name for name, limit in limits.items() if 1 - limit.demanded < RARE]
        if only_rare := {*names} <= {*rare}:
            names, self._rankings = rare, {}
        if n >= REFITTED * self._fitted:
            self._rankings, self._fitted = {}, n
        chosen = []
        for name in names:
            limit, values = limits[name], trials.response(name)
            ranking = self._rankings.get(name)
            if ranking is None:
                ranking = Ranking.fitted(trials.deviations, values, limit)
            else:
                ranking = ranking.of_more(trials.deviations)
            if ranking is None:
                return []
            self._rankings[name] = ranking
            out = out_of_limit(values, self.sample.done, limit)
            permitted, near = 1 - limit.demanded, None
            if only_rare:
                distances = margins(values, limit.permitted)
                distances[~self.sample.done] = -np.inf
                near = near_chances(ranking, distances, thinned, permitted)
            chosen.append(near or chances(ranking, out, thinned, permitted))
        return chosen
