"""Mistakes of an author: each is refused with a sentence, none answers "done"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolstat.errors import ModelError
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write


@compiled(rates_signature)
def swing(moment, y, p, out):
    x, v, c, b = rows(y)[0], rows(y)[1], rows(p)[0], rows(p)[1]
    write(out, 0, (v, -c * x - b * v, x, v))


@compiled(rates_signature)
def exchanged(moment, y, p, out):
    write(out, 0, (rows(y)[1], rows(y)[0]))


@compiled(rates_signature)
def one_too_few(moment, y, p, out):
    write(out, 0, (rows(y)[0],))


@compiled(rates_signature)
def gap_in_the_middle(moment, y, p, out):
    write(out, 0, (rows(y)[1],))
    write(out, 2, (rows(y)[0], rows(y)[1]))


@compiled(rates_signature)
def later(moment, y, p, out):
    """Fills and reads too much in the second phase alone."""
    x, v = rows(y)[0], rows(y)[1]
    phase = rows(moment)[1]
    write(out, 0, (v, -x * np.where(phase > 0.0, rows(p)[2], 1.0), x, v))


@compiled(rates_signature)
def writes_states(moment, y, p, out):
    x, v = rows(y)[0], rows(y)[1]
    write(y, 0, (x + 0.01,))
    write(out, 0, (v, -x, x, v))


SYSTEM = System(swing, np.ones(2), n_extremes=2)
GIVEN = {
    "start": np.array([[1.0, 0.0], [1.1, 0.0]]),
    "parameters": np.array([[4.0, 0.1], [4.1, 0.1]]),
    "marks": np.array([[0.0, 0.5, 2.0], [0.0, 0.5, 2.0]]),
    "accuracy": Accuracy(1e-6, 0.1),
}


def solved(system=SYSTEM, **given):
    return integrate(system, **{**GIVEN, **given})


def test_without_a_mistake():
    assert (solved(samples=np.linspace(0.0, 2.0, 5), watch_from=1).status == 1).all()


MISTAKES = {
    "fewer parameters than read": (
        {"parameters": GIVEN["parameters"][:, :1]},
        "rates reads more rows than there are: 2 states, 1 parameters and 0 sides",
    ),
    "fewer rows than trials": (
        {"parameters": GIVEN["parameters"][:1]},
        "parameters has 1 rows: a row for each of 2 trials is expected",
    ),
    "fewer marks than trials": (
        {"marks": GIVEN["marks"][:1]},
        "marks has 1 rows: a row for each of 2 trials is expected",
    ),
    "one mark": ({"marks": GIVEN["marks"][:, :1]}, "start and end are needed"),
    "marks descend": (
        {"marks": GIVEN["marks"][:, ::-1]},
        "marks: ascending times are expected",
    ),
    "states without a scale": (
        {"system": replace(SYSTEM, scale=np.ones(1))},
        "scale has shape (1,): a size for each of 2 states is expected",
    ),
    "scale below zero": (
        {"system": replace(SYSTEM, scale=np.array([1.0, -1.0]))},
        "sizes above zero are expected",
    ),
    "rtol below zero": ({"accuracy": Accuracy(-1e-6, 0.1)}, "rtol -1e-06: a number"),
    "rtol is no number": ({"accuracy": Accuracy(np.nan, 0.1)}, "rtol nan: a number"),
    "longest step zero": ({"accuracy": Accuracy(1e-6, 0.0)}, "max_step 0.0: a number"),
    "watched from a phase after the end": (
        {"watch_from": 2},
        "watch_from 2: a phase from 0 to 1 is expected",
    ),
    "samples before the start": (
        {"samples": np.array([-0.5, 1.0])},
        "samples from -0.5 to 1 s: times from 0 to 2 s are expected",
    ),
    "samples after the end": ({"samples": np.array([0.0, 2.5])}, "from 0 to 2.5 s"),
    "samples unsorted": (
        {"samples": np.array([1.0, 0.5])},
        "samples: ascending times are expected",
    ),
    "watch in another order": (
        {"system": replace(SYSTEM, watch=exchanged)},
        "watch fills row 0 with other numbers than rates its row 2",
    ),
    "watch fills a row too few": (
        {"system": replace(SYSTEM, watch=one_too_few)},
        "watch fills 1 rows, but 2 are declared",
    ),
    "rates fill more than declared": (
        {"system": replace(SYSTEM, n_extremes=1)},
        "rates fills 4 rows, but 3 are declared",
    ),
    "a row of out is left out": (
        {"system": replace(SYSTEM, rates=gap_in_the_middle)},
        "rates does not fill row 1 of out",
    ),
    "reads too much in a later phase": (
        {"system": replace(SYSTEM, rates=later)},
        "rates reads more rows than there are",
    ),
    "writes into the states": (
        {"system": replace(SYSTEM, rates=writes_states)},
        "rates writes into y or p; it fills out alone",
    ),
    "a mark that is no number": (
        {"marks": np.array([[0.0, np.nan, 2.0], [0.0, 0.5, 2.0]])},
        "finite times are expected",
    ),
    "a jump without sides": (
        {"system": replace(SYSTEM, crossings=(0,), jump=exchanged)},
        "jump fills 2 rows, but 3 are declared",
    ),
}


@pytest.mark.parametrize(("given", "words"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_refused(given, words):
    with pytest.raises(ModelError) as refused:
        solved(**given)
    assert words in str(refused.value)


@pytest.mark.parametrize("name", ["start", "parameters", "marks"])
def test_one_row_without_its_table_is_refused(name):
    with pytest.raises(ModelError, match=f"{name} has shape"):
        integrate(SYSTEM, **GIVEN | {name: GIVEN[name][0]})
