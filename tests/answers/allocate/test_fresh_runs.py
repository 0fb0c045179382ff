"""Fresh runs: of the study as written, cached, with little memory."""

from __future__ import annotations

import gc
import tomllib
import tracemalloc

import numpy as np

from tests.answers.allocate.linear_stack import (
    Here,
    Linear,
    closed_form,
    reciprocal,
    searching,
)
from tolstat import Description, Outcome, Response
from tolstat.answers.allocate.fresh_runs import GROWTH, FreshRuns
from tolstat.study.study import load


def test_the_fresh_run_as_specified_equals_the_study():
    given = reciprocal()
    given["deviations"]["link_1"]["tolerance"] = "0.1..0.18009 mm"
    given["deviations"]["link_3"]["tolerance"] = "+-0.12349 mm"
    search = searching(given)
    scheme = search.runs.prove(search.specified, 8).scheme
    study = load(given | {"trials": 2500}, model=Linear(), seed=8)
    assert np.array_equal(search.runs.workers.latest, study.deviations())
    assert search.runs.as_written(search.specified) == search.specified
    assert scheme.tolerances["link_1"] == "0.1..0.18009 mm"


def test_an_unchanged_entry_keeps_its_text():
    law = {"law": "reciprocal", "at": "+-0.02 mm", "price": 2}
    graded = {"iso1328": 7, "module": "12 mm", "cost": law}
    given = {"model": "stand", "trials": 8, "seed": 1}
    study = load({**given, "deviations": {"runout_7": graded}})
    runs = FreshRuns(study, Here(), 8, lambda progress: None)
    (drawn,) = study.deviating.priced
    choice = (drawn.specified_choice,)
    assert tomllib.loads(runs.study_text(choice)) == tomllib.loads(study.text)
    assert runs.as_written(choice) == choice
    assert drawn.text(drawn.specified_choice) == "iso1328 = 7"
    other = tomllib.loads(runs.study_text((drawn.specified_choice - 0.1,)))
    assert other["deviations"]["runout_7"] == {"tolerance": "0..33 um", "cost": law}


def test_repeated_choices_reuse_their_run():
    search = searching(reciprocal())
    runs, drawn = search.runs, search.specified
    wide = runs.workers.machines
    assert wide == search.wide_trials == 2500
    first = runs.prove(drawn, 8)
    assert runs.prove(drawn, 8).scheme == first.scheme and runs.lengths == (2500,)
    assert (
        runs.prove(drawn, 9).scheme.fraction_out_of_limit
        != first.scheme.fraction_out_of_limit
    )
    # a choice whose verdict takes longer goes on from there
    near = runs.as_written(tuple(np.log(0.97 * closed_form()[1])))
    short = runs.prove(near, 8)
    assert short.yields["gap"].verdict == "undecided"
    longer = runs.prove(near, 8, most=10_000)
    assert runs.lengths == (2500, 2500, longer.scheme.trials)
    assert 2500 < runs.lengths[2] <= 10_000
    assert np.array_equal(longer.out_of_limit[:, :2500], short.out_of_limit)
    assert runs.prove(near, 8) == longer
    # not in steps of a quarter: as many as are said to decide
    assert longer.scheme.trials >= min(short.yields["gap"].needed, 10_000)
    assert short.yields["gap"].needed > GROWTH * 2500
    assert runs.workers.machines - wide == sum(runs.lengths)


def test_fresh_runs_keep_little_memory():
    """Six runs, and in memory about a tenth of what one of them answered."""

    class Many(Linear):
        def describe(self, settings):
            links, _ = super().describe(settings)
            names = ["gap", *(f"gap_{i}" for i in range(39))]
            return Description(links, tuple(Response(n, "m", n, "a") for n in names))

        def evaluate(self, deviations, settings):
            (gap,) = super().evaluate(deviations, settings).responses.T
            return Outcome(np.repeat(gap[:, None], 40, axis=1))

    search = searching(reciprocal(), Many(), trials=20_000)
    search.runs.prove(search.tightest, 9)  # loads what is needed
    tracemalloc.start()
    for seed in range(10, 16):
        proof = search.runs.prove(search.tightest, seed)
        search.pool.add(search.tightest, seed, proof.out_of_limit)
    gc.collect()
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    latest = search.runs.workers.latest.nbytes  # what evaluates here remembers it
    assert search.pool.trials == 7 * 20_000
    assert kept - latest < 0.11 * 20_000 * 40 * 8
