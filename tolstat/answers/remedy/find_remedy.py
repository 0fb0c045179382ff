"""What meets all limits of a run together: searched, and proved where that is quick."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial, reduce
from itertools import compress
from typing import NamedTuple

import numpy as np

from tolstat.answers.next_steps import command, to_change, typed_entries
from tolstat.answers.remedy.changed_entries import (
    ChangeableEntries,
    changeable_entries,
    changed_entries,
    typed_tolerance,
)
from tolstat.answers.remedy.remedy_finding import (
    EntryChange,
    Evidence,
    RemedyFinding,
    RemedyStep,
    Unavoidable,
)
from tolstat.answers.remedy.tightened_causes import Causes, tightened_causes
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array
from tolstat.catalogue import custom_names
from tolstat.document.inline import Typed
from tolstat.errors import TolstatError
from tolstat.execution.compatibility import is_other_source, seconds_per_trial, study_of
from tolstat.execution.run_loop import evaluate_stages
from tolstat.execution.stages import SampledStages
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.remedies import unavoidable as minimum
from tolstat.statistics.remedies.change import Change
from tolstat.statistics.remedies.movable_trials import (
    LEAST_TRIALS,
    MovableTrials,
    NoRemedy,
    movable_trials,
)
from tolstat.statistics.remedies.prediction import (
    Shares,
    Step,
    both,
    predicted,
    proved,
    steps,
)
from tolstat.statistics.remedies.remedy import (
    AIM_PREDICTED,
    AIM_PROVED,
    smallest_change,
)
from tolstat.store.stored_run import Run
from tolstat.study.editor import StudyChange
from tolstat.study.study import Study, load

# of a proof; more where a limit permits few out of it, to find so many of these
FRESH_TRIALS, MOST_FRESH, TELLING = 20_000, 200_000, 50
FARTHEST_UNPROVED = 1.0  # half tolerances that a centre moves
STRAIGHT = 1e-6  # of sigma: what a linear surface leaves
QUICK, QUICK_INTEGRATED = 10.0, 1.0  # s, that a proof may take; of equations of motion
WORTHWHILE = 0.5  # share out of limit, over that before, of a change that meets none
NOTHING_HELPS = "no change of the free tolerances and centres is known to help"
TOLD = (NoRemedy.FREE, NoRemedy.FAILED)  # other refusals say nothing to a reader


class _ProofError(Exception):
    """Fresh trials prove nothing; the message says why."""


class _Tried(NamedTuple):
    """A change that improves, and how it does."""

    change: Change
    steps: tuple[Step, ...]
    met: bool  # all limits
    proved: int  # by so many fresh trials; 0: predicted

    @property
    def after(self) -> Shares:
        """Shares out of limit after all steps."""
        return self.steps[-1].after


def remedy_of(drawn: Drawn, causes: Causes) -> RemedyFinding | None:
    """Return what meets all limits of a complete run of sampled trials.

    None where nothing can be said: too few trials, say. The main free causes of limits
    that are not met are tightened where a surface of the responses shows nothing that
    helps.
    """
    run = drawn.run
    entries = changeable_entries(run)
    if not entries.names:
        return None
    limits = [*run.limits.values()]
    judged = drawn.judged(min(1 - limit.demanded for limit in limits))
    columns = [judged.values(name) for name in entries.contributors]
    trials = movable_trials(
        np.stack(columns, axis=1),
        np.stack([judged.values(name) for name in run.limits], axis=1),
        judged.sample, limits, entries.design,
    )  # fmt: skip
    if isinstance(trials, NoRemedy):
        return RemedyFinding(reason=trials.value) if trials in TOLD else None
    search = _Search(drawn, entries, trials, causes)
    if rest := minimum.unavoidable(trials, AIM_PROVED):
        wider, proved_by = search.wider_limits()
        unavoidable = _unavoidable(run, entries, rest, wider)
        return RemedyFinding(unavoidable=unavoidable, trials=proved_by)
    return search.finding()


class _Search:
    """The search of a remedy of a run."""

    def __init__(
        self,
        drawn: Drawn,
        entries: ChangeableEntries,
        trials: MovableTrials,
        causes: Causes,
    ) -> None:
        self.drawn, self.causes = drawn, causes
        self.run, self.entries, self.trials = drawn.run, entries, trials
        self.seed = drawn.sampled.seed
        self.note = ""  # why nothing is proved
        self.proving: Typed | None = None  # the command that would prove it

    @cached_property
    def study(self) -> Study | None:
        """The study with the model of the run; None without its data, or the model.

        A custom model of a name may be another one by now.
        """
        try:
            study = study_of(self.run, model=self.drawn.model)
        except TolstatError:
            return None
        return None if is_other_source(self.run, study) else study

    def finding(self) -> RemedyFinding:
        """Return the remedy, or why there is none."""
        before = predicted(self.trials, self.trials.design.none)
        tried = self._tried(before) or self._by_weights(before)
        if tried is None:
            return RemedyFinding(reason=NOTHING_HELPS, note=self.note)
        missed = tried.after.missed(self.trials.permitted_out)
        pairs = zip(before.limits, tried.after.limits, strict=True)
        changed = StudyChange(changed_entries(self.run, self.entries, tried.change))
        return RemedyFinding(
            tuple(self._steps(tried.steps, before)),
            Evidence.PROVED if tried.proved else Evidence.PREDICTED,
            trials=tried.proved,
            met=tried.met, missed=tuple(compress(self.run.limits, missed)),
            limits=dict(zip(self.run.limits, pairs, strict=True)),
            change=changed, entries=typed_entries(changed.deviations),
            commands=to_change(self.run, changed), note=self.note,
            proving=self.proving,
        )  # fmt: skip

    def wider_limits(self) -> tuple[dict[str, tuple[float, float]], int]:
        """Return limits that the design as it is meets, and the trials that prove it.

        Without limits where nothing is evaluated here, or a limit is not the fault.
        """
        if (fresh := self.fresh_trials) is None:
            return {}, 0
        none, run = self.trials.design.none, self.run
        try:
            first, second = (
                self.trials.sampled_again(none, *fresh(none, seed)) for seed in range(2)
            )
        except (_ProofError, TolstatError):
            return {}, 0
        scales = [run.scales[name].factor for name in run.limits]
        permitted = minimum.wider_limits(first, second, np.array(scales))
        if permitted is None:
            return {}, 0
        return _other_limits(run, permitted), fresh.number

    def _steps(self, steps: Sequence[Step], before: Shares) -> Iterator[RemedyStep]:
        """Yield steps by name, with the yields before and after."""
        for step in steps:
            changes = _changes(self.run, self.entries, step.change)
            pair = before.joint.complement, step.after.joint.complement
            yield RemedyStep(changes, *pair)
            before = step.after

    def _tried(self, before: Shares) -> _Tried | None:
        """Return a change that was searched, proved where that is quick."""
        if (fresh := self.fresh_trials) is not None:
            try:
                proof = proved(self.trials, fresh)
                if proof is None or not proof.steps:
                    return None
                return self._judged(proof.change, proof.steps, before, fresh.number)
            except (_ProofError, TolstatError) as error:
                self.note = str(error)
        trials = self.trials
        # nothing is known of a response farther off than its trials, but that a
        # straight one may go on so
        if not _straight(trials):
            near = trials.design._replace(farthest=FARTHEST_UNPROVED)
            trials = replace(trials, design=near)
        change = smallest_change(trials, AIM_PREDICTED).change
        if not (change.size or len(change.tightened)):
            return None
        shares = partial(predicted, trials)
        found = [*steps(trials, change, shares)]
        change = reduce(both, (step.change for step in found))
        tried = self._judged(change, found, before)
        far = np.abs(change.shift).max() > FARTHEST_UNPROVED
        sure = trials.all_had_chances and not far
        return tried and tried._replace(met=tried.met and sure)

    def _judged(
        self, change: Change, steps: Iterable[Step], before: Shares, proved: int = 0
    ) -> _Tried | None:
        """Return a change with its steps; None unless it improves.

        One that surely misses a limit has to improve by much.
        """
        steps, permitted = tuple(steps), self.trials.permitted_out
        after = steps[-1].after
        little = after.joint.upper > WORTHWHILE * before.joint.value
        missed = any(after.missed(permitted))
        if not after.improve(before, permitted) or (missed and little):
            return None
        return _Tried(change, steps, after.permitted(permitted), proved)

    def _by_weights(self, before: Shares) -> _Tried | None:
        """Return tighter causes that help, by weights; proved where that is quick."""
        if (study := self.study) is None:
            return None
        best = None
        for step in tightened_causes(self.drawn, study, self.entries, self.causes):
            tried = self._judged(step.change, [step], before)
            if tried is None:
                continue
            if (
                best is None
                or tried.met
                or tried.after.joint.value < best.after.joint.value
            ):
                best = tried
            if tried.met:
                break
        if best is None or (fresh := self.fresh_trials) is None:
            return best
        try:
            sample = fresh(best.change, 0)
        except (_ProofError, TolstatError) as error:
            self.note = str(error)
            return best
        again = self.trials.sampled_again(best.change, *sample)
        step = Step(best.change, predicted(again, again.design.none))
        return self._judged(best.change, [step], before, fresh.number)

    @cached_property
    def fresh_trials(self) -> "_FreshTrials | None":
        """Fresh trials of changed studies; None if they take long, or say nothing."""
        run = self.run
        if run.listed:
            return None  # nothing is evaluated here
        seconds = seconds_per_trial(run, self.study)
        most = QUICK if run.steps is None else QUICK_INTEGRATED
        if seconds * FRESH_TRIALS > most:
            return None
        if (study := self.study) is None:
            if self.drawn.model or run.model in custom_names():
                self.note = "the model, or its data, differ from those of the run"
            elif run.machine:
                self.proving = command("report", run.path, machine=run.machine)
            return None
        telling = TELLING / self.trials.permitted_out.min()
        number = min(telling, most / max(seconds, 1e-9), MOST_FRESH)
        return _FreshTrials(self, study, max(int(number), FRESH_TRIALS))


def _straight(trials: MovableTrials) -> bool:
    """Return whether all responses are linear in all trials."""
    surface, sigma = trials.surface, trials.responses.std(axis=0)
    exact = surface.remainders <= STRAIGHT * sigma
    return bool(exact.all() and surface.is_straight)


class _FreshTrials:
    """Evaluates fresh trials of changed studies."""

    def __init__(self, search: _Search, study: Study, number: int) -> None:
        self._search, self._study, self.number = search, study, number

    def __call__(self, change: Change, seed: int) -> tuple[Array, Array]:
        """Return deviations and responses; the seed counts from 0."""
        search = self._search
        editor = self._study.editor()
        for name, entry in changed_entries(search.run, search.entries, change).items():
            editor.change(name, entry)
        words = np.random.SeedSequence([search.seed, FRESH_TRIALS, seed + 1])
        editor.table |= {"sampling": "random", "trials": self.number}
        study = load(
            editor.table, model=self._study.model, seed=int(words.generate_state(1)[0]),
            folder=search.run.data_folder,
        )  # fmt: skip
        stages = SampledStages(study)
        with Workers() as workers:
            evaluate_stages(
                study.model, stages, stages.trials, workers, lambda progress: None
            )
        trials, names = stages.trials, [c.name for c in study.description.contributors]
        columns = [names.index(name) for name in search.entries.contributors]
        responses = [trials.response(name) for name in search.run.limits]
        done = int(np.isfinite(responses).all(axis=0).sum())
        if done < LEAST_TRIALS:
            raise _ProofError(f"only {done} of {self.number} fresh trials do not fail")
        return trials.deviations[:, columns], np.stack(responses, axis=1)


def _other_limits(run: Run, permitted: Array) -> dict[str, tuple[float, float]]:
    """Return the permitted ends, SI, that are not those of the study, by response."""
    pairs = zip(run.limits.items(), permitted.tolist(), strict=True)
    return {
        name: (lower, upper)
        for (name, limit), (lower, upper) in pairs
        if (lower, upper) != tuple(limit.permitted)
    }


def _unavoidable(
    run: Run,
    entries: ChangeableEntries,
    rest: minimum.Unavoidable,
    wider: Mapping[str, tuple[float, float]],
) -> Unavoidable:
    """Return what stays out of limit, by name."""
    return Unavoidable(
        rest.shares.joint,
        {
            entries.names[i]: float(rest.contributions[i])
            for i in np.argsort(-rest.contributions, kind="stable").tolist()
            if rest.contributions[i] > 0
        },
        wider,
        tuple(
            _entry_change(run, entries, freed.change, freed.entry)
            for freed in rest.freed
        ),
        {
            name: beyond
            for name, beyond in zip(run.limits, rest.beyond.tolist(), strict=True)
            if beyond
        },
    )


def _changes(
    run: Run, entries: ChangeableEntries, change: Change
) -> tuple[EntryChange, ...]:
    chosen = sorted({*change.shifted.tolist(), *change.tightened.tolist()})
    return tuple(_entry_change(run, entries, change, i) for i in chosen)


def _entry_change(
    run: Run, entries: ChangeableEntries, change: Change, entry: int
) -> EntryChange:
    """Return the change of one of the entries, by name."""
    members, ratio = entries.members[entry], float(change.ratio[entry])
    return EntryChange(
        entries.names[entry],
        members,
        shift=float(change.shift[entry] * entries.design.halves[entry]),
        tolerance=typed_tolerance(run, members[0], ratio) if ratio < 1 else "",
    )
