"""What an author may write in `motion`, and the sentence for all else."""

from __future__ import annotations

import math
import time
from functools import cached_property

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tolstat.errors import ModelError
from tolstat.moving import Motion, Part, Response, State, ends, held, memory

PX, PY = [0.0, 1.0, 2.0], [0.0, 2.0, 1.0]


class Given(Motion):
    """Two states, two parts, one response."""

    lasts = 1.0
    x = State("m", size=1.0)
    v = State("m/s", size=1.0)
    k = Part(2.0, "1/s^2")
    m = Part(1.0, "kg")
    peak = Response.peak("m")


class Plain(Given):
    """The same without units."""

    x = State("1", size=1.0)
    v = State("1", size=1.0)
    k = Part(2.0, "1")
    peak = Response.peak("1")


def traced(expression):
    """Trace a motion whose acceleration is an expression of t, x, v, k, m."""

    def motion(self, t, y, p):
        names = {"t": t, "x": y.x, "v": y.v, "k": p.k, "np": np, "math": math}
        a = eval(expression, names | {"PX": PX, "PY": PY})
        return {"x": y.v, "v": a, "peak": y.x}

    return type("Tried", (Plain,), {"motion": motion})


WORKS = [
    "-k * x", "x**2", "x**2.5", "x**-2", "k**x", "-x + 1", "+x", "abs(x)", "np.abs(x)",
    "np.sign(v)", "np.tanh(v / 0.01)", "np.hypot(x, v)", "np.tan(x)", 
    "np.arctan2(x, 2)",
    "np.square(v)", "np.clip(x, -1, 1)", "np.clip(x, 0, None)", "np.minimum(x, v)",
    "np.where(x > 0, k * x, 0.0)", "np.where((x > 0) & (v < 1) | (t > 0.5), 1.0, x)",
    "np.where(~(x > 0), 1.0, 2.0)", "(x > 0) * k", "k * (t < 0.5)",
    "np.interp(x, PX, PY)", "np.interp(t, PX, PY)",
    "np.interp(t % 0.3, PX, PY)",
    "t % 0.25", "x % 0.25", "np.floor(4 * t)", "np.floor(x)",
    "np.polyval([1, 2, 3], x)",
    "np.select([x < 0, x < 1], [1.0, 2.0], 3.0)", "sum(x * i for i in range(3))",
    "np.sum(np.array([x, v]) * np.array([1.0, 2.0]))", "np.dot([1, 2], [x, v])",
    "np.array([x, v]) @ np.array([2.0, 3.0])", "np.where(k > 1.0, x, v)",
    "np.cbrt(k) * x", "np.arcsin(0.5 * np.sin(x))", "np.heaviside(t - 0.5, 1.0)",
    "np.sqrt(np.abs(x))", "np.maximum(0, 1 - np.exp(-t))", "max([1.0, 2.0]) * x",
    "np.where(x > 0, np.where(v > 0, 1.0, 2.0), 3.0)", "np.cosh(x)", "np.log1p(x * x)",
]  # fmt: skip

REFUSED = {
    "1.0 if x > 0 else 2.0": "np.where(condition, a, b)",
    "max(x, 0.0)": "np.maximum for max",
    "x > 0 and v > 0": "& and | for `and` and `or`",
    "math.sin(x)": "write np.sin for math.sin",
    "math.floor(t)": "write np.sin for math.sin",
    "np.linalg.solve(np.array([[k, 1], [1, x]]), [1, 2])[0]": "work in equations",
    "np.where(x, 1.0, 2.0)": "a condition such as y.x > 0",
    "np.where(x == 0.0, 1.0, 2.0)": "use < >",
    "np.sinc(x)": "work in equations of motion",
    "np.gradient(x)": "work in equations of motion",
    "np.interp(x, PX, PY, left=0.0)": "write it without left=",
    "np.interp(x, [1, 0], [0, 1])": "places ascending",
    "x[0]": "work in equations of motion",
    "list(x)": "it is one number",
    "x + 'm'": "is not a number",
    "np.erf(x)": "work in equations of motion",
    "np.random.normal(x)": "write np.sin for math.sin",
    "range(x)": "a whole plain number",
}


@pytest.mark.parametrize("expression", WORKS)
def test_an_everyday_expression_is_traced(expression):
    equations = traced(expression).equations
    assert equations.text.count("def rates") == 1
    compile(equations.text, "traced", "exec")


@pytest.mark.parametrize("expression", REFUSED)
def test_what_cannot_be_traced_is_one_sentence(expression):
    with pytest.raises(ModelError) as caught:
        traced(expression)
    message = str(caught.value)
    assert REFUSED[expression] in message and "Tried: " in message
    assert len(message) < 400 and "\n" not in message


def motion_of(returned, **declared):
    return type(
        "Tried",
        (Given,),
        {"motion": lambda self, t, y, p: returned(t, y, p), **declared},
    )


def good(y):
    return {"x": y.v, "v": -9.0 * y.x, "peak": y.x}


@pytest.mark.parametrize(
    ("returned", "declared", "words"),
    [
        (lambda t, y, p: {"x": y.v, "v": y.x}, {}, "returns nothing for 'peak'"),
        (lambda t, y, p: good(y) | {"peek": 1.0}, {}, "did you mean 'peak'"),
        (lambda t, y, p: {"x": y.w, "v": y.x}, {}, "no state is called w"),
        (lambda t, y, p: {"x": p.n, "v": y.x}, {}, "no part is called n"),
        (lambda t, y, p: (y.v, y.x), {}, "motion returns a dict"),
        (lambda t, y, p: good(y), {"lasts": 0.0}, "how long a trial lasts"),
        (lambda t, y, p: good(y) | {"x": None}, {}, "None is not a number"),
        (lambda t, y, p: ends((y.x > 1) & (y.v > 1)) or good(y), {}, "one comparison"),
        (lambda t, y, p: ends(t > 0.5) or good(y), {}, "one comparison of a state"),
        (lambda t, y, p: memory(1.0, y.x > 0) or good(y), {}, "a condition such as"),
        (lambda t, y, p: good(y), {"m": Part(1.0, "kilo")}, "m: "),
        (lambda t, y, p: good(y), {"x": State("mm")}, "'mm' is not an SI unit"),
        (
            lambda t, y, p: good(y),
            {"x": State("m/s")},
            "motion returns 'x' in m/s; m/s^2",
        ),
        (lambda t, y, p: good(y) | {"v": y.x + y.v}, {}, "m and m/s are added"),
        (lambda t, y, p: good(y) | {"v": np.sin(y.v)}, {}, "np.sin of m/s"),
        (
            lambda t, y, p: good(y) | {"peak": p.m},
            {},
            "motion returns 'peak' in kg; m is",
        ),
    ],
)
def test_a_declaration_that_does_not_fit_is_a_sentence(returned, declared, words):
    with pytest.raises(ModelError, match="Tried: ") as caught:
        motion_of(returned, **declared)
    assert words in str(caught.value)


def test_a_typed_number_may_have_any_unit():
    for number in (1.0, 2.0):  # 1.0 N s/m as any other
        motion_of(lambda t, y, p, b=number: good(y) | {"v": b * y.x - b * y.v})


def test_broken_powers_have_any_unit():
    """No unit can be written for them: of a weir, an orifice, Hertz's contact."""
    c = Part(0.1, "m/s^2", "of a weir, at 1 m")
    for power in (np.sqrt, lambda x: x**1.5):
        motion_of(
            lambda t, y, p, power=power: good(y) | {"v": p.c * power(y.x) - p.k * y.x},
            c=c,
        )


def test_events_outside_of_motion_are_refused():
    for call in (lambda: held(1.0, every=1.0), lambda: ends(True)):
        with pytest.raises(ModelError, match="inside `motion` alone"):
            call()


def kept_in_self(self, y):
    self.on = np.where(y.x < 0.0, 1.0, getattr(self, "on", 0.0))
    return self.on


def kept_in_a_list(self, y, kept=[0.0]):  # noqa: B006
    kept[0] = np.where(y.x < 0.0, 1.0, kept[0])
    return kept[0]


def drawn(self, y):
    return np.random.default_rng().normal() * y.x


def of_a_clock(self, y):
    return time.perf_counter() * y.x


CALLS = "other equations when it is called again"


@pytest.mark.parametrize(
    ("rate", "words"),
    [
        (kept_in_self, r"test_refused.py, line \d+: motion changes self.on.*memory\("),
        (kept_in_a_list, CALLS),
        (drawn, CALLS),
        (of_a_clock, CALLS),
    ],
)
def test_what_a_record_would_freeze_is_refused(rate, words):
    def motion(self, t, y, p):
        return {"x": y.v, "v": rate(self, y), "peak": y.x}

    with pytest.raises(ModelError, match=words):
        type("Freezing", (Plain,), {"motion": motion})


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("float(x)", "y.x for float"),
        ("[1.0, 2.0][int(t)]", "np.where or np.select"),
        ("[1.0, 2.0][x > 0.0]", "np.where or np.select"),
        ("round(x)", "np.round"),
        ("spline(x)", "np.interp"),
    ],
)
def test_a_plain_number_is_refused_with_what_to_write(expression, words):
    spline = CubicSpline(PX, PY)

    def motion(self, t, y, p):
        a = eval(expression, {"x": y.x, "t": t, "np": np, "spline": spline})
        return {"x": y.v, "v": a, "peak": y.x}

    with pytest.raises(ModelError, match=rf"test_refused.py, line \d+: .*{words}"):
        type("Tried", (Plain,), {"motion": motion})


def test_a_table_read_at_first_is_no_memory():
    class Tabled(Plain):
        @cached_property
        def table(self):
            return [0.0, 2.0, 1.0]

        def motion(self, t, y, p):
            return {"x": y.v, "v": np.interp(y.x, PX, self.table), "peak": y.x}

    assert "peak" in Tabled.responses
