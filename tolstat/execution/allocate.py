"""The cheapest tolerances that meet all limits: found by weighting, proved afresh."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Callable
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.weighting import Weighting
from tolstat.errors import DistributionError, StudyError
from tolstat.execution.allocation import (
    Allocation,
    Line,
    Point,
    Scheme,
    trade_off,
)
from tolstat.execution.carrying_out import Progress, Telling
from tolstat.execution.elsewhere import crew_of
from tolstat.execution.linear_schemes import LinearSchemes
from tolstat.execution.pool import Pool, with_choice
from tolstat.execution.trials import Trials
from tolstat.execution.workers import Interrupted, Workers
from tolstat.model.contract import Model
from tolstat.statistics.cheapest import Choice, Dial, cheapest
from tolstat.statistics.sample import Sample
from tolstat.statistics.yields import MET, NOT_MET, Yield, joint_yield, yield_of
from tolstat.study.document import MOST_SEED
from tolstat.study.points import Case
from tolstat.study.prices import EXAMPLE, tolerance_words, with_tolerances
from tolstat.study.size import too_large
from tolstat.study.study import Source, Study, load

Array = NDArray[np.float64]

ENOUGH = 50  # machines that would be beyond a limit if as many were as it permits
WIDE = (("loosest", 0.5), ("halfway", 0.25), ("tightest", 0.25))  # of the wide run
MOST_PROVED = 6  # allocations that are proved, the cheaper ones after the first as well
TIGHTER = 0.95  # of the shares permitted, after each that was not proved
CHEAPER = 0.005  # than what is proved, that another one is worth its proof
LONGEST = 4  # times as many trials as it begins with
EVEN = 0.5  # as likely as not: of what is drawn, or proved for itself
CURVE = 2.0 ** np.arange(-4.5, 5.0, 1.5)  # times the share beyond any limit
FREE = 0.02  # of the share that a limit permits: as good as nothing
GROWTH = 1.25  # of a proof, at least
BISECTIONS = 5
FEWER = 100  # times fewer machines beyond than on the curve
AT_END = 1e-6
LOOSER = 0.1  # of a tolerance: a step that shows which limit binds


def allocate(
    study: Source,
    *,
    trials: int | None = None,
    workers: int | None = None,
    model: Model | None = None,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Allocation:
    """Find the cheapest tolerances with which a study meets all its limits.

    Parameters
    ----------
    study : path or mapping
        A study file, or what one would hold; lines of [deviations] have a `cost`.
    trials : int, optional
        Of the wide run, and of each proof at its first look; else as many as the
        strictest limit needs, or as the study has if these are more.
    workers, model, progress, executor
        As of `tolstat.run`.

    Returns
    -------
    Allocation
        `.text` is the study that it found. Nothing is stored.

    Raises
    ------
    StudyError
        If the study is wrong, draws nothing, has no limit or no cost.
    """
    asked = load(study, model=model)
    with crew_of(workers, executor) as crew:
        return allocated(asked, crew, trials=trials, progress=progress)


def allocated(
    study: Study,
    workers: Workers,
    *,
    trials: int | None = None,
    progress: Telling | None = None,
) -> Allocation:
    """Allocate the tolerances of a checked study; see `allocate`."""
    _check(study)
    strictest = min(1 - limit.demanded for limit in study.limits.values())
    count = trials or max(study.trials, math.ceil(ENOUGH / strictest))
    if wrong := too_large(LONGEST * count, study.description):
        source = study.path or "the study"
        raise StudyError(
            f"{source}: a proof may take {LONGEST} times {count} trials: {wrong}; ask "
            "for fewer (--trials), or demand less of the limits"
        )
    tell = progress or (lambda progress: None)
    return _Allocating(study, workers, count, tell).found()


def _check(study: Study) -> None:
    """Refuse what has nothing to be allocated, or cannot be weighted."""
    source = study.path or "the study"
    if study.sampler is None:
        raise StudyError(
            f'{source}: sampling = "{study.sampling}" draws nothing; tolerances are '
            "allocated to machines that are drawn"
        )
    if not study.limits:
        raise StudyError(
            f"{source} has no [limits]: without them the loosest tolerances are the "
            "cheapest; say what is permitted, and of how many machines"
        )
    deviating = study.deviating
    if not deviating.priced:
        raise StudyError(
            f"{source}: no line of [deviations] or [links] says what it costs by its "
            f"tolerance; give one or more of them cost = {EXAMPLE}"
        )
    nowhere = {name: np.zeros(1) for name in deviating.distributions}
    for line in deviating.priced:
        tightest, loosest = map(line.distributions, line.ends)
        drawn = {**deviating.distributions, **loosest}
        try:
            Weighting(nowhere, drawn, deviating.dependence).weights(tightest)
        except DistributionError as error:
            raise StudyError(
                f"{source}: {line.name} has a cost, and cannot be weighted: {error}; "
                "leave its cost out, or give it another distribution"
            ) from None


class _Proof(NamedTuple):
    """A fresh run of some tolerances."""

    choice: Choice
    scheme: Scheme
    yields: dict[str, Yield]
    run: Trials

    @property
    def met(self) -> bool:
        return all(each.verdict == MET for each in self.yields.values())


class _Allocating:
    """An allocation under way."""

    def __init__(
        self, study: Study, workers: Workers, trials: int, tell: Telling
    ) -> None:
        self.study, self.workers, self.trials, self.tell = study, workers, trials, tell
        self.priced = study.deviating.priced
        self.permitted = np.array([1 - each.demanded for each in study.limits.values()])
        self.pool = Pool(study)
        self.dials = [
            Dial(each.cost, *each.ends, len(each.offered)) for each in self.priced
        ]
        self.drawn: Choice = tuple(each.as_drawn for each in self.priced)
        self.tightest: Choice = tuple(each.ends[0] for each in self.priced)
        self.at_tightest: _Proof | None = None  # that meets no limit, or not all
        self.notes: list[str] = []
        self.seed = study.seed or 0

    def found(self) -> Allocation:
        """Find the tolerances, prove them, and look around."""
        self._draw_wide()
        proof = self._searched()
        answer = proof or self.at_tightest or self._proved(self.tightest, self.seed)
        seed, trials = answer.scheme.seed, self.trials
        schemes = {
            "as drawn": self._proved(self.drawn, seed, trials).scheme,
            "found" if proof else "tightest": answer.scheme,
        }
        points = self._points(answer.choice)
        if proof:
            spent = self._for_the_cost_drawn(points, answer.choice)
            schemes["at the cost drawn"] = self._proved(spent, seed, trials).scheme
        schemes |= self._linear(seed)
        return Allocation(
            met=proof is not None,
            cost=answer.scheme.cost,
            tolerances=answer.scheme.halves,
            lines=self._lines(answer.choice),
            schemes=schemes,
            verdicts={name: each.verdict for name, each in answer.yields.items()},
            active=self._active(answer.choice),
            notes=tuple(self.notes),
            curve=trade_off(points, schemes),
            text=self._with(answer.choice, _heading(self.study, answer, schemes)),
        )

    # --- the search

    def _draw_wide(self) -> None:
        """Evaluate the wide run."""
        loosest = tuple(each.ends[1] for each in self.priced)
        halfway = tuple(
            0.5 * sum(each.ends) if each.law else float(len(each.offered) // 2)
            for each in self.priced
        )
        sets = {"loosest": loosest, "halfway": halfway, "tightest": self.tightest}
        for name, share in WIDE:
            study = with_choice(
                self.study, sets[name], self.seed, math.ceil(share * self.trials)
            )
            run = Trials.planned(study.description, study.deviations())
            self._evaluate(study, run, "wide run")
            self.pool.add(sets[name], run)
            self.seed = (self.seed + 1) % (MOST_SEED + 1)

    def _excess(self, times: float) -> Callable[[Choice], Array]:
        """Return how far the upper ends of the shares beyond are above the permitted.

        Parameters
        ----------
        times : float
            Of the shares that the limits permit.
        """

        def excess(choice: Choice) -> Array:
            if self.workers.stopping():
                raise Interrupted
            most = self.pool.most(choice)[:-1]
            return np.log(most / (times * self.permitted))

        return excess

    def _for_any(self, share: float) -> Callable[[Choice], Array]:
        """Return how far the share beyond any limit is above one, likely as not."""

        def excess(choice: Choice) -> Array:
            if self.workers.stopping():
                raise Interrupted
            return np.log(self.pool.most(choice, EVEN)[-1:] / share)

        return excess

    def _searched(self) -> _Proof | None:
        """Search and prove in turn; return the cheapest that is proved."""
        best: _Proof | None = None
        vain: set[Choice] = set()
        start: Choice | None = None
        every, times = True, 1.0
        for number in range(1, MOST_PROVED + 1):
            self.tell(Progress(0, 0, 0, f"search {number}"))
            found = cheapest(self.dials, self._excess(times), start)
            if found is None and (best or self.at_tightest):
                break
            # where weights show nothing that meets the limits, a run may
            choice = self._as_written(found.choice if found else self.tightest)
            every = every and (found is None or found.every)
            if best and self._cost(choice) > (1 - CHEAPER) * best.scheme.cost:
                break
            if choice in vain:
                times *= TIGHTER
                continue
            proof = self._proved(choice, self.seed)
            self.seed = (self.seed + 1) % (MOST_SEED + 1)
            self.pool.add(choice, proof.run)
            start = choice
            if proof.met:
                best, times = proof, 1.0
            elif found is None:
                self.at_tightest = proof
            else:
                vain.add(choice)
                times *= TIGHTER
                self._note_vain(proof)
        if not every:
            self.notes.append(
                "too many combinations to try them all: tolerances were exchanged one "
                "or two at a time, so that a cheaper set may exist"
            )
        return best

    def _note_vain(self, proof: _Proof) -> None:
        said = ", ".join(
            f"{name}: {each.verdict}"
            for name, each in proof.yields.items()
            if each.verdict != MET
        )
        self.notes.append(
            f"found for {proof.scheme.cost:.4g}, and not shown by a fresh run of "
            f"{proof.scheme.trials} machines ({said}); searched again"
        )

    # --- fresh runs

    def _written(self, choice: Choice) -> Study:
        """Return the study with some tolerances, read from the file it would be."""
        text = self._with(choice, "")
        folder = self.study.path.parent if self.study.path else None
        return load(tomllib.loads(text), model=self.study.model, folder=folder)

    def _with(self, choice: Choice, heading: str) -> str:
        words = {
            each.name: tolerance_words(each, x)
            for each, x in zip(self.priced, choice, strict=True)
        }
        return with_tolerances(self.study.text, words, heading)

    def _as_written(self, choice: Choice) -> Choice:
        """Return the choice that a file holds, whose digits are few."""
        return tuple(each.as_drawn for each in self._written(choice).deviating.priced)

    def _cost(self, choice: Choice) -> float:
        pairs = zip(self.priced, choice, strict=True)
        return math.fsum(each.cost(x) for each, x in pairs)

    def _proved(self, choice: Choice, seed: int, trials: int = 0) -> _Proof:
        """Run some tolerances afresh; extended while their verdicts are not settled.

        Parameters
        ----------
        choice : tuple of float
            As it is written.
        seed : int
            Of the run.
        trials : int
            How many, whatever they tell; as many as decide if not given.
        """
        answer = self._written(choice)
        count, most = trials or self.trials, LONGEST * self.trials
        run: Trials | None = None
        while True:
            study = dataclasses.replace(
                answer, sampling="random", until=None, seed=seed, trials=count
            )
            more = Trials.planned(study.description, study.deviations())
            if run:
                more.keep(run)
            self._evaluate(study, more, "fresh run")
            run, sample = more, Sample(more.status)
            yields = {
                name: yield_of(
                    run.response(name), sample, each.permitted, each.demanded
                )
                for name, each in study.limits.items()
            }
            verdicts = {each.verdict for each in yields.values()}
            wanted = max(each.needed or most for each in yields.values())
            if trials or verdicts == {MET} or NOT_MET in verdicts or count >= most:
                break
            count = min(max(wanted, math.ceil(GROWTH * count)), most)
        beyond = {name: each.beyond for name, each in yields.items()}
        responses = {name: run.response(name) for name in study.limits}
        ends = {name: each.permitted for name, each in study.limits.items()}
        joint = joint_yield(responses, sample, ends)
        pairs = list(zip(self.priced, choice, strict=True))
        scheme = Scheme(
            self._cost(choice),
            {each.name: tolerance_words(each, x) for each, x in pairs},
            {each.name: each.half(x) for each, x in pairs},
            beyond,
            joint.complement,
            count,
            seed,
        )
        return _Proof(choice, scheme, yields, run)

    def _evaluate(self, study: Study, run: Trials, doing: str) -> None:
        """Evaluate the machines of a run that are not over."""
        cases = [Case(run.over, len(run.status), study.settings)]
        asked = len(run.status)
        for blocks in self.workers.blocks(study.model, cases, run.deviations):
            run.take(blocks)
            self.tell(Progress(run.over, run.failed, asked, doing))
        if run.over < asked:
            raise Interrupted

    # --- what lies around

    def _points(self, start: Choice) -> list[Point]:
        """Find the cheapest tolerances for other shares beyond any limit."""
        points, reference = [], float(self.pool.most(start, EVEN)[-1])
        self.tell(Progress(0, 0, 0, "trade-off"))
        for times in CURVE[::-1]:
            share = min(float(times) * reference, 1.0)
            if found := cheapest(self.dials, self._for_any(share), start):
                start = found.choice
                points.append(Point(found.cost, share, start))
        return points

    def _for_the_cost_drawn(self, points: list[Point], start: Choice) -> Choice:
        """Find the tolerances that put the fewest beyond for the cost as drawn."""
        cost = self._cost(self.drawn)
        least, best = float(self.pool.most(self.drawn, EVEN)[-1]), self.drawn
        for each in points:
            written = self._as_written(each.choice)
            if each.beyond < least and self._cost(written) <= cost:
                least, best = each.beyond, written
        high = math.log(least)
        dearer = [e.beyond for e in points if e.cost > cost and e.beyond < least]
        low = math.log(max(dearer)) if dearer else high - math.log(FEWER)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            found = cheapest(self.dials, self._for_any(math.exp(middle)), start)
            written = self._as_written(found.choice) if found else self.tightest
            if found and self._cost(written) <= cost:
                best, high = written, middle
            else:
                low = middle
        return best

    def _linear(self, seed: int) -> dict[str, Scheme]:
        """Allocate as linear analysis does; what comes of that, by a fresh run."""
        linear = LinearSchemes(self.study, self.workers)
        if not linear.known:
            self.notes.append("no worst case and root sum square: slopes are not known")
            return {}
        schemes = {}
        for name, excess in (
            ("root sum square", linear.root_sum_square),
            ("worst case", linear.worst_case),
        ):
            if found := cheapest(self.dials, excess, self.tightest):
                choice = self._as_written(found.choice)
                schemes[name] = self._proved(choice, seed, self.trials).scheme
            else:
                self.notes.append(f"no tolerances meet the limits by {name}")
        return schemes

    def _lines(self, choice: Choice) -> tuple[Line, ...]:
        free = self._free(choice)
        return tuple(
            Line(
                each.name, len(each.drawn), tolerance_words(each, drawn),
                tolerance_words(each, x), each.cost(drawn), each.cost(x),
                abs(x - each.ends[1]) < AT_END, i in free,
            )
            for i, (each, drawn, x) in enumerate(
                zip(self.priced, self.drawn, choice, strict=True)
            )
        )  # fmt: skip

    def _free(self, choice: Choice) -> set[int]:
        """Return lines whose width, as far as it goes, costs no yield."""
        found = set()
        for i, each in enumerate(self.priced):
            tightest, loosest = (
                self.pool.about((*choice[:i], end, *choice[i + 1 :]))[:-1]
                for end in each.ends
            )
            if np.all(loosest - tightest <= FREE * self.permitted):
                found.add(i)
        return found

    def _active(self, choice: Choice) -> tuple[str, ...]:
        """Name the limits that a step looser of some tolerance would break."""
        broken = np.zeros(len(self.permitted), np.bool_)
        for i, each in enumerate(self.priced):
            step = math.log(1 + LOOSER) if each.law else -1.0
            looser = choice[i] + step
            within = looser <= each.ends[1] if each.law else looser >= each.ends[1]
            if within:
                near = (*choice[:i], looser, *choice[i + 1 :])
                broken |= self._excess(1.0)(near) > 0
        names = list(self.study.limits)
        return tuple(n for n, own in zip(names, broken.tolist(), strict=True) if own)


def _heading(study: Study, answer: _Proof, schemes: dict[str, Scheme]) -> str:
    """Say above a study where its tolerances come from."""
    scheme, drawn = answer.scheme, schemes["as drawn"]
    shown = "meet every limit" if answer.met else "do NOT meet every limit"
    of = study.path.name if study.path else "a study"
    said = (
        f"Tolerances allocated by tolstat allocate {of}: cost {scheme.cost:.6g}, as "
        f"drawn {drawn.cost:.6g}.\nThey {shown} in a run of {scheme.trials} random "
        f"machines with seed {scheme.seed}"
    )
    if study.sampling == "random":
        said += f":\ntolstat run THIS --trials {scheme.trials} --seed {scheme.seed}"
    return said
