"""The loop: a proposer gives stages, workers evaluate them, the record takes them."""

from __future__ import annotations

from concurrent.futures import Executor, Future

import numpy as np
import pytest

from tolstat.errors import LostError
from tolstat.execution.run_loop import evaluate_stages
from tolstat.execution.stages import SampledStages, Shortfall, Stage, Trials
from tolstat.execution.workers.block_scheduler import Interrupted, Workers
from tolstat.execution.workers.local_blocks import Block, Evaluated, Mismatch, Threads
from tolstat.execution.workers.remote_blocks import Processes
from tolstat.model.checked import simulate
from tolstat.study.given_points import Case
from tolstat.study.study import load

CHAIN = {
    "model": "dimension_chain", "seed": 3, "trials": 50, "settings": {"gap": "A - B"},
    "links": {n: {"nominal": "9 mm", "tolerance": "+-0.1 mm"} for n in "AB"},
    "limits": {"gap": "0..1 mm"},
}  # fmt: skip


@pytest.fixture
def study():
    return load(CHAIN)


class Halves:
    """Twenty trials, then as many as were out of limit: it looks at the answers."""

    def __init__(self, study):
        self.rows, self.settings, self.looks = study.deviations(), study.settings, []

    def next(self, trials):
        self.looks.append(trials.ended)
        first, stop = self.looks[-1], 20
        if len(self.looks) == 2:
            stop = 20 + int((trials.response("gap") < 0).sum())
        if len(self.looks) == 3:
            return None
        shortfall = Shortfall(99.0, ("a rule",), 50) if first else None
        cases = [Case(0, stop, self.settings)]
        return Stage(first, self.rows[first:stop], cases, shortfall=shortfall)


def empty(study):
    columns = len(study.description.contributors)
    return Trials.planned(study.description, np.zeros((0, columns)))


def test_each_stage_follows_the_answers_of_those_before(study):
    trials, proposer, seen = empty(study), Halves(study), []
    with Workers(1, block=7) as crew:
        number = evaluate_stages(
            study.model, proposer, trials, crew, seen.append, doing="two stages"
        )
    assert number == trials.ended == len(trials.status) > 25
    assert proposer.looks == [0, 20, number]
    alone = simulate(study.model, study.deviations()[:number], study.settings)
    np.testing.assert_array_equal(trials.responses, alone.responses)
    told = [progress for progress in seen if progress.wanted]
    assert [(p.over, p.wanted, p.rules, p.at_most) for p in told] == [
        (20, 99.0, ("a rule",), 50)
    ]
    assert {progress.doing for progress in seen} == {"two stages"}
    assert seen[-1].over == seen[-1].asked == number


def test_trials_that_ended_are_not_evaluated_again(study):
    stages, ran = SampledStages(study), []
    trials = stages.trials
    trials.status[5:30] = 1
    assert stages.next(trials) is stages.next(trials)  # while it is not over
    with Workers(1) as crew:
        evaluate_stages(study.model, stages, trials, crew, lambda progress: None,
                        check=ran.extend)  # fmt: skip
    rows = [first + i for first, block in ran for i in range(len(block.status))]
    assert sorted(rows) == [*range(5), *range(30, 50)]
    assert stages.next(trials) is None


def test_the_loop_ends_when_workers_stop(study):
    stages = SampledStages(study)
    with Workers(1, lambda: True) as crew, pytest.raises(Interrupted):
        evaluate_stages(study.model, stages, stages.trials, crew, lambda progress: None)


class Here(Executor):
    """It calls at once, and may return something else."""

    def __init__(self, changed=lambda outcome: outcome):
        self.changed = changed

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(self.changed(fn(*args, **kwargs)))
        return future


def test_workers_of_every_kind_have_one_face(study):
    block = Block(study.model, study.deviations()[:9], study.settings)
    outcomes = []
    for pool in (Threads(1), Processes(Here())):
        outcomes.append(pool.answer(pool.submit(block), block))
        assert pool.number >= 1
        pool.close(wait=True)
    one, other = outcomes
    assert isinstance(one, Evaluated) and isinstance(other, Evaluated)
    np.testing.assert_array_equal(one.answers.responses, other.answers.responses)
    assert one.answers.responses.shape == block.shape


def test_a_worker_that_cannot_be_used_is_a_mismatch_or_a_loss(study):
    block = Block(study.model, study.deviations()[:9], study.settings)
    other = Here(lambda _: Mismatch("it", ("another processor",)))
    pool = Processes(other)
    with pytest.raises(LostError, match="it: another processor"):
        pool.answer(pool.submit(block), block)
    refused = []
    other.refuse = refused.append
    assert pool.answer(pool.submit(block), block) == refused[0]
    shorter = Processes(Here(lambda outcome: (outcome[0], "a text")))
    with pytest.raises(LostError, match="not the answers of 9 trials"):
        shorter.answer(shorter.submit(block), block)
