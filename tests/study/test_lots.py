"""Parts of many lots: means of lots vary, parts scatter about them."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tests.study.chains import chain, problems_of
from tolstat.answers.report.lots import within_lots
from tolstat.execution.workers.local_blocks import Block, evaluate
from tolstat.execution.workers.remote_blocks import carried_out, packed
from tolstat.model.checked import simulate
from tolstat.study.study import load

LINKS = {"a": "10 +-0.03 mm", "b": "9.9 +-0.03 mm"}
LOT = {"a_lot": "+-0.04 mm"}


def test_performance_within_lots_and_overall(tmp_path):
    study = chain("a - b", LINKS, deviations=LOT, limits={"gap": "0..0.2 mm"})
    run = tolstat.run({**study, "trials": 20_000}, output=tmp_path / "lots.h5")
    within, between = 0.01 * math.sqrt(2), 0.04 / 3
    assert 1e3 * run.frame()["gap"].std() == pytest.approx(
        math.hypot(within, between), rel=0.02
    )
    numbers = {number.name: number.value for number in run.numbers}
    assert 1e3 * numbers["rss_sigma"] == pytest.approx(math.hypot(within, between))
    assert numbers["worst_max"] == pytest.approx(0.2e-3)
    response = tolstat.report(run).responses["gap"]
    overall = response.limited.moments
    assert overall.pp.value == pytest.approx(
        0.1 / 3 / math.hypot(within, between), rel=0.02
    )
    names = [part.name for part in run.contributors]
    alone = within_lots(overall, response.contributions, names)
    assert alone.pp.value == pytest.approx(0.1 / 3 / within, rel=0.02)
    assert within_lots(overall, response.contributions, ["a_lot", "b"]) is None
    assert tolstat.replay(run, 3).differences == ()


def test_a_lot_moves_all_parts_of_a_name():
    study = {
        "model": "toy", "trials": 16, "seed": 1, "settings": {"gain": 2},
        "deviations": {"part_lot": "+-0.1 mm", "angle": "+-1 deg"},
    }  # fmt: skip
    loaded = load(study, model=Toy())
    names = [part.name for part in loaded.description.contributors]
    assert names == ["part_1", "part_2", "angle", "part_lot"]
    rows = np.array([[0.1e-3, 0.0, 0.0, 0.02e-3]])
    responses = simulate(loaded.model, rows, loaded.settings).responses[0]
    assert responses == pytest.approx([2 * 0.14e-3, 0.12])


def test_lots_leave_the_deviations_of_parts_as_they_are():
    plain, lots = (
        load(chain("a - b", LINKS)),
        load(chain("a - b", LINKS, deviations=LOT)),
    )
    assert np.array_equal(plain.deviations(), lots.deviations()[:, :2])


def test_a_lot_of_no_part_is_refused():
    said = problems_of(chain("a - b", LINKS, deviations={"c_lot": "+-1 um"}))
    assert "[deviations] c_lot" in said and "unknown" in said


def test_lots_in_cases_at_worst_means():
    links = {**LINKS, "b": {"nominal": "9.9 mm", "tolerance": "+-9 um",
                            "mean_within": "+-0.01 mm"}}  # fmt: skip
    cases = {"thin": {"a": "9.95 mm"}, "thick": {"a": "10 mm"}}
    run = tolstat.run(chain("a - b", links, deviations=LOT, cases=cases))
    gap = run.frame()["gap_at_thin_at_least"]
    assert gap.mean() == pytest.approx(0.04e-3, abs=2e-6)
    assert gap.std() == pytest.approx(math.hypot(10, 40 / 3, 3) * 1e-6, rel=0.06)


def test_other_processes_evaluate_cases_lots_and_worst_means():
    links = {**LINKS, "b": {"nominal": "9.9 mm", "tolerance": "+-9 um",
                            "mean_within": "+-0.01 mm"}}  # fmt: skip
    cases = {"thin": {"a": "9.95 mm"}, "thick": {"a": "10 mm"}}
    study = load(chain("a - b", links, deviations=LOT, cases=cases))
    block = Block(study.model, study.deviations()[:64], study.settings)
    here = evaluate(block).answers
    there = carried_out(packed(partial(evaluate, block))).answers
    assert np.array_equal(here.responses, there.responses)
    assert study.model.unwrapped.name == "dimension_chain"
    digests = {
        load(chain("a - b", LINKS)).model.source_digest,
        study.model.source_digest,
    }
    assert len(digests) == 2
