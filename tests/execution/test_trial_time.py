"""How long a trial takes: as long as its model, also after a run that took longer."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

import tolstat
from tests.conftest import Toy
from tolstat import Contributor, Description
from tolstat.execution.compatibility import seconds_per_trial, study_of


class Slow(Toy):
    """10 ms a trial."""

    def __init__(self):
        self.rows = []

    def evaluate(self, deviations, settings):
        self.rows.append(len(deviations))
        time.sleep(0.01 * len(deviations))
        return super().evaluate(deviations, settings)


@pytest.mark.parametrize(("seconds", "is_tried"), [(30.0, False), (6.0, True)])
def test_a_slow_model_is_not_tried_for_long(toy, toy_study, seconds, is_tried):
    run = tolstat.run(toy_study, model=toy, trials=30)
    busy, slow = replace(run, times={**run.times, "seconds": seconds}), Slow()
    study = replace(study_of(run, model=toy), model=slow)
    assert 0.01 <= seconds_per_trial(busy, study) <= seconds / 30
    assert bool(slow.rows) == is_tried and max(slow.rows, default=0) < 30
    quick = seconds_per_trial(busy, replace(study, model=toy))
    assert quick < 0.05 or not is_tried


def test_of_a_model_that_has_other_contributors_now_no_trial_is_tried(toy, toy_study):
    class Longer(Slow):
        def describe(self, settings):
            contributors, responses = super().describe(settings)
            return Description((*contributors, Contributor("more", "m")), responses)

    run, longer = tolstat.run(toy_study, model=toy, trials=30), Longer()
    study = study_of(run, model=toy)
    description = longer.describe(study.settings)
    changed = replace(study, model=longer, description=description)
    assert seconds_per_trial(run, changed) == run.times["seconds"] / 30
    assert not longer.rows
