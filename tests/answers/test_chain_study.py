"""A chain from Python, and a plain function as a model."""

from __future__ import annotations

import tomllib
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numba
import numpy as np
import pytest

import tolstat
from tolstat import catalogue
from tolstat.errors import ModelError, StudyError
from tolstat.units.conversion import from_si

SEAT, RING = "25 +0.1/-0.05 mm", "24.9 h8 mm"
# a part of a model's file; the pages say how it is named on the command line
FILE = '''
import tolstat

@tolstat.as_model(inputs={"a": "10 mm", "b": "9 mm"}, outputs={"gap": "mm"})
def stack(a, b):
    """A stack."""
    return a - b
'''


def ring(**keys):
    """A ring in its seat, as a study of six lines."""
    chain = tolstat.Chain("Ring", trials=2000, **keys).link("seat", SEAT)
    return chain.link("ring", RING).limit("play", "0..0.3 mm")


@tolstat.as_model(
    inputs={"seat": "25 mm", "ring": "24.9 mm"}, outputs={"play": "mm", "ratio": "1"}
)
def fit(seat, ring):
    """Play and ratio of a fit."""
    return seat - ring, seat / ring


def test_a_chain_is_the_study_of_its_file(tmp_path):
    chain = ring().gap("play", "seat - ring")
    path = tmp_path / "ring.toml"
    path.write_text(chain.to_toml())
    run, stored = chain.run(), tolstat.run(path)
    assert np.array_equal(run.column("play"), stored.column("play"))
    assert run.to_toml() == chain.to_toml() == stored.study.text
    assert run.report().verdicts == tolstat.report(stored).verdicts
    wider = run.what_if(seat="+-0.02 mm", limits={"play": ">= 0.05 mm"})
    limits = {"play": ">= 0.05 mm"}
    again = tolstat.what_if(stored, {"seat": "+-0.02 mm"}, limits=limits)
    assert wider.all_limits.scenario == again.all_limits.scenario
    figure = run.plot()
    assert figure.axes[0].get_xlabel() == "play, mm"
    assert tolstat.save(run, tmp_path / "saved.h5").trials == 2000


def test_methods_of_a_chain_leave_it_as_it_is():
    chain = ring()
    one = chain.gap("play", "seat - ring")
    other = tolstat.Chain().link("seat", "25 mm", tolerance="+-0.1 mm", cp=1.33)
    assert "gaps" not in chain.to_dict() and "gaps" in one.to_dict()
    assert other.to_dict()["links"]["seat"] == {
        "nominal": "25 mm", "tolerance": "+-0.1 mm", "cp": 1.33,
    }  # fmt: skip
    demanding = one.limit("play", ">= 0 mm", ppm=100)
    assert tomllib.loads(demanding.to_toml())["limits"]["play"]["ppm"] == 100


def test_a_chain_has_loops():
    loop = "crank @ phi + rod @ theta - slide @ 0 deg"
    chain = tolstat.Chain(trials=100).loop("main", loop, theta="197 deg")
    chain = chain.link("crank", "50 +-0.1 mm").link("rod", "150 mm")
    run = chain.link("phi", "60 deg").run()
    assert run.nominal["slide"] < 0  # the way of the start


def test_a_chain_has_cases():
    chain = ring().gap("play", "seat - ring*(1 + a*dT)").limit("play", ">= 0 mm")
    chain = chain.link("a", "12e-6 1/K").link("dT", "0 K").case("hot", dT="60 K")
    assert chain.run().nominal["play_at_hot"] == pytest.approx(0.1e-3 - 24.9e-3 * 72e-5)


def test_a_wrong_chain_is_refused_as_a_study_is():
    with pytest.raises(StudyError, match=r"'rng'.*has no rng; did you mean 'ring'"):
        ring().gap("play", "seat - rng").run()
    with pytest.raises(StudyError, match=r"\[links\] seat"):
        tolstat.Chain().link("seat", "25 +0.1/-0.5 mn").gap("g", "seat").run()


@pytest.mark.parametrize(
    ("add", "words"),
    [
        (
            lambda chain: chain.link("seat", "26 mm"),
            r"\[links\] seat is given twice, as",
        ),
        (
            lambda chain: chain.gap("play", "ring"),
            "seat - ring and as ring; start from",
        ),
        (lambda chain: chain.loop("l", "a @ 0 deg").loop("l", "b @ b"), r"\[loops\] l"),
    ],
)
def test_a_second_entry_of_a_name_is_refused(add, words):
    with pytest.raises(StudyError, match=words):
        add(ring().gap("play", "seat - ring"))


TWO_SUPPLIERS = [
    {"share": "70 %", "mean": "10 mm", "sigma": "20 um"},
    {"share": "30 %", "mean": "10.05 mm", "sigma": "20 um"},
]


def test_what_a_chain_can_say_stands_in_its_text():
    """Every method and every type of value: read from the text it is the same study."""
    chain = (
        tolstat.Chain(
            'A "chain"\n of all', 2000, 9, study={"document": {"revision": "B"}}
        )
        .link("crank", "50 ±0,1 mm", cost={"+-0.1 mm": 4.5, "+-0.05 mm": 9})
        .link("rod", "150 +0.2/-0.1 mm", cpk=1.33, fixed=True)
        .link("phi", "60° ±30'")
        .link("mixed", "10 mm", distribution="mixture", parts=TWO_SUPPLIERS)
        .link("pair", "30 H7/g6 mm")
        .loop("main", "crank @ phi + rod @ theta - slide @ 0 deg", theta="-17 deg")
        .gap("reach", "slide + mixed")
        .gap("clearance", "pair_hole − pair_shaft")
        .limit("reach", "178..179 mm", yield_="99 %")
        .limit("clearance", "≥ 0 mm", ppk=1.33)
        .case("near", phi="50 deg")
        .case("far", phi="70 deg")
    )
    read = tomllib.loads(chain.to_toml())
    assert read == chain.to_dict()
    assert read["limits"]["reach"] == {"limit": "178..179 mm", "yield": "99 %"}
    run, again = chain.run(), tolstat.run(read)
    assert tomllib.loads(run.to_toml()) == read
    assert np.array_equal(run.column("reach_at_far"), again.column("reach_at_far"))
    assert run.limits["reach_at_near"].demanded == pytest.approx(0.99)
    answer = run.what_if(pair_hole="H6", crank="±0,08 mm")
    assert {*answer.changes} == {"pair_hole", "crank"}


def test_a_function_gets_sizes_in_its_units():
    run = ring(model=fit).run()
    chain = ring().gap("play", "seat - ring").run()
    np.testing.assert_allclose(run.column("play"), chain.column("play"), atol=1e-17)
    seat, outer = (
        from_si(nominal + run.column(name), "m", "mm")
        for name, nominal in (("seat", 0.025), ("ring", 0.0249))
    )
    np.testing.assert_allclose(run.column("ratio"), seat / outer, rtol=1e-14)
    answer = run.what_if(ring="+-0.001 mm")
    assert answer.responses
    assert fit(3, 2) == (1, 1.5)  # still the function
    answers = tolstat.evaluate(fit, {"seat": [0.0, 1e-3]})
    assert answers["play"].to_numpy() == pytest.approx([0.1e-3, 1.1e-3])
    assert tolstat.evaluate(fit)["ratio"].item() == pytest.approx(25 / 24.9)


def test_a_function_is_resumed_and_extended_and_known_by_its_code(tmp_path):
    run = tolstat.save(ring(model=fit).run(), tmp_path / "fit.h5")
    longer = tolstat.extend(run, 2100, model=fit)
    assert longer.trials == 2100
    others = [
        tolstat.as_model(inputs=inputs, outputs={"x": "mm"})(lambda a: a).source_digest
        for inputs in ({"a": "1 mm"}, {"a": "2 mm"})
    ]
    assert others[0] != others[1]


def test_functions_without_a_file_are_known_by_what_they_call():
    digests = []
    for body in ("np.sin(a)", "np.cos(a)", "(lambda b: b)(a)", "(lambda b: b)(a)"):
        names = {"np": np}
        exec(f"def f(a):\n    return {body}", names)
        model = tolstat.as_model(inputs={"a": "1"}, outputs={"x": "1"})(names["f"])
        digests.append(model.source_digest)
    assert len({*digests[:3]}) == 3
    assert digests[2] == digests[3]  # typed again, in another place of the memory


def test_other_processes_find_a_function_in_its_file(tmp_path):
    study = {"model": "stack", "trials": 64, "seed": 1, "links": {"a": "10 +-0.1 mm"}}
    path = tmp_path / "stack.py"
    path.write_text(FILE)
    model = catalogue.load(f"{path}:stack")
    here = tolstat.run(study, model=model)
    with ProcessPoolExecutor(1) as pool:
        there = tolstat.run(study, model=model, executor=pool)
        with pytest.raises(ModelError, match="other processes cannot find it"):
            tolstat.run(
                {"model": "fit", "trials": 8, "seed": 1, "links": {"seat": SEAT}},
                model=fit, executor=pool,
            )  # fmt: skip
    assert np.array_equal(here.column("gap"), there.column("gap"))


@pytest.mark.parametrize(
    "inputs, outputs, words",
    [
        ({"a": "25 +-0.1 mm"}, {"x": "mm"}, "a study gives its tolerance"),
        ({"b": "25 mm"}, {"x": "mm"}, "a: the inputs b are not the arguments a"),
        ({"a": "25 mm"}, {"x": "mn"}, "unknown unit 'mn'"),
        ({"a": "25 mm"}, {}, "inputs and outputs are needed"),
        ({"a": 25}, {"x": "mm"}, "a nominal value such as"),
    ],
)
def test_wrong_declarations_are_refused(inputs, outputs, words):
    with pytest.raises(ModelError, match=words.replace("+", r"\+")):
        tolstat.as_model(inputs=inputs, outputs=outputs)(lambda a: a)


@pytest.mark.parametrize(
    "returned, words",
    [
        ([1.0, 2.0, 3.0], "2 arrays are expected of the function, not 3"),
        ({"x": 1.0}, "a dict with the keys x, y is expected"),
        ((np.zeros(7), 0.0), "an array of 1 trials is expected"),
        ((0.0, None), "real numbers are expected of the function for y"),
        ((0.0, 1j), "real numbers are expected of the function for y"),
        ((0.0, True), "real numbers are expected of the function for y, not"),
        ((np.ma.masked_less([0.0], 1.0), 0.0), "for x, not masked ones"),
    ],
)
def test_wrong_answers_are_refused(returned, words):
    model = tolstat.as_model(inputs={"a": "1 mm"}, outputs={"x": "mm", "y": "mm"})
    with pytest.raises(ModelError, match=words):
        tolstat.evaluate(model(lambda a: returned))


def test_a_truth_value_is_a_number_without_unit():
    model = tolstat.as_model(inputs={"a": "1 mm"}, outputs={"fits": "1"})
    assert tolstat.evaluate(model(lambda a: a > 0.5))["fits"].tolist() == [1.0]


def test_a_compiled_function_is_a_model_and_what_is_no_function_is_refused():
    @numba.njit
    def twice(a):
        return 2 * a

    declared = tolstat.as_model(inputs={"a": "1 mm"}, outputs={"x": "mm"})
    run = tolstat.Chain(model=declared(twice), trials=10).link("a", "1 mm").run()
    assert run.column("x") == pytest.approx(np.full(10, 2e-3))
    with pytest.raises(ModelError, match=r"partial.*a function is expected"):
        declared(partial(lambda a: a))


def test_links_of_a_function_are_its_inputs():
    with pytest.raises(StudyError, match="no input is called rod; allowed: seat, ring"):
        ring(model=fit).link("rod", "2 mm").run()
    with pytest.raises(StudyError, match="the input seat is in mm, not in deg"):
        tolstat.Chain(model=fit).link("seat", "2 deg").run()
