"""Marks, sliding, samples, memory and ends of traced motions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tolstat
from tests.moving.gallery import errors, model_of
from tolstat import setting
from tolstat.errors import ModelError
from tolstat.execution.diagnostics.kinks import kinks_of
from tolstat.moving import Motion, Part, Response, State, ends, held, memory, sampled

SLIDING = (
    "belt", "brake", "clutch", "gear", "pendulum", "thermostat", "cylinder", "stop",
)  # fmt: skip


@pytest.mark.parametrize("rtol", [1e-3, 1e-9])
@pytest.mark.parametrize("name", SLIDING)
def test_sliding_release_and_impacts_follow_rtol(name, rtol):
    assert errors(name, rtol).max() < 10.0 * rtol


def values(kind, deviations=None, **settings):
    frame = tolstat.evaluate(kind, deviations or {}, settings)
    assert (frame["status"] == "done").all()
    return frame


class Blocks(Motion):
    """Two blocks, one on the other; the lower one on the ground, which is pulled."""

    lasts = 4.0
    x1 = State("m", size=1.0)
    v1 = State("m/s", size=1.0)
    x2 = State("m", size=1.0)
    v2 = State("m/s", size=1.0)
    ground = Part(20.0, "N", "friction of the ground")
    between = Part(6.0, "N", "friction of the blocks")
    pull = Part(30.0, "N", "amplitude of the pull")
    m2 = Part(1.0, "kg", "upper block")
    far1 = Response.end("m")
    far2 = Response.end("m")
    rest = Response.above("s", "time in which the lower block moves forwards")
    heat = Response.integral("J")

    def motion(self, t, y, p):
        ground = -p.ground * np.sign(y.v1)
        between = -p.between * np.sign(y.v2 - y.v1)
        return {
            "x1": y.v1,
            "v1": (p.pull * np.sin(3.0 * t) + ground - between) / 2.0,
            "x2": y.v2,
            "v2": between / p.m2,
            "far1": y.x1,
            "far2": y.x2,
            "rest": y.v1,
            "heat": -ground * y.v1 - between * (y.v2 - y.v1),
        }


def blocks_by_small_steps(ground, between, pull, n=200_000):
    """The same by implicit steps of first order (Moreau): friction as a projection."""
    h, v1, v2, x1, x2, heat = 4.0 / n, 0.0, 0.0, 0.0, 0.0, 0.0
    pulls = pull * np.sin(3.0 * h * (np.arange(n) + 0.5))
    g = b = 0.0
    for F in pulls.tolist():
        for _ in range(30):
            before = g, b
            w1 = v1 + h * (F - b) / 2.0
            g = min(max(-2.0 * w1 / h, -ground), ground)
            w1, w2 = v1 + h * (F + g) / 2.0, v2
            # b changes v2 - v1 by h b (1 + 1/2)
            b = min(max(-(w2 - w1) / (1.5 * h), -between), between)
            if abs(g - before[0]) + abs(b - before[1]) < 1e-13:
                break
        v1, v2 = v1 + h * (F + g - b) / 2.0, v2 + h * b
        x1, x2 = x1 + h * v1, x2 + h * v2
        heat += h * (-g * v1 - b * (v2 - v1))
    return x1, x2, heat


def test_two_surfaces_at_once():
    frame = values(Blocks, {"ground": [0.0, -12.0, 5.0], "between": [0.0, 8.0, 0.0]})
    for row, parts in zip(frame.itertuples(), [(20, 6), (8, 14), (25, 6)], strict=True):
        known = blocks_by_small_steps(*map(float, parts), 30.0)
        assert (row.far1, row.far2, row.heat) == pytest.approx(known, rel=2e-3)
    assert frame["steps"].max() < 1000


def test_three_surfaces_that_move_each_other_are_refused():
    with pytest.raises(ModelError, match="more than two jumps move each other"):

        class Three(Blocks):
            v3 = State("m/s")

            def motion(self, t, y, p):
                top = 3.0 * np.sign(y.v3 - y.v2)
                rates = super().motion(t, y, p)
                return rates | {"v2": rates["v2"] + top, "v3": -top}


class Held(Motion):
    """A block at rest under a force that grows until it slips; started at rest."""

    lasts = 2.0
    v = State("m/s", size=1.0)
    F = Part(3.0, "m/s^2", "friction over the mass")
    speed = Response.end("m/s")
    friction = Response.peak("m/s^2")
    moving = Response.above("s")

    def motion(self, t, y, p):
        R = np.where(y.v > 0.0, -p.F, np.where(y.v < 0.0, p.F, 0.0))
        return {"v": 4.0 * t + R, "speed": y.v, "friction": R, "moving": y.v}


def test_a_part_that_starts_at_rest_sticks_until_the_load_exceeds_its_friction():
    frame = values(Held)
    slips = 3.0 / 4.0
    assert frame["speed"][0] == pytest.approx(2.0 * (4 - slips**2) - 3.0 * (2 - slips))
    assert frame["moving"][0] == pytest.approx(2.0 - slips, abs=1e-6)
    assert frame["friction"][0] == pytest.approx(3.0)


class Uneven(Held):
    """Friction whose factor depends on the way, too: not linear in the side."""

    def motion(self, t, y, p):
        R = -np.sign(y.v) * np.where(y.v > 0.0, p.F, 1.5 * p.F)
        return {"v": 4.0 - 4.0 * t + R, "speed": y.v, "friction": R, "moving": y.v}


def test_a_jump_that_is_not_linear_in_the_side():
    frame = values(Uneven)
    # forwards until 0.5 s, at rest up to a load of 1.5 F
    assert frame["moving"][0] == pytest.approx(0.5, rel=1e-6)
    assert frame["speed"][0] == pytest.approx(0.0, abs=1e-9)


class Ball(Motion):
    """A ball that is thrown from the ground, and held values of it."""

    lasts = setting(3.0, "how long at most", unit="s", above=0.0)
    h = State("m")
    v = State("m/s", start=lambda p: p.v0)
    count = State("1")
    v0 = Part(10.0, "m/s")
    time = Response.end("s")
    seen = Response.end("m", "height at the last sample")
    samples = Response.end("1")
    twice = Response.end("m")

    def motion(self, t, y, p):
        ends(y.h < 0.0)
        seen = held(y.h, every=0.3)
        return {
            "h": y.v,
            "v": -9.81,
            "count": sampled(y.count + 1.0, every=0.1),
            "time": t,
            "seen": seen,
            "samples": y.count,
            "twice": held(2.0 * seen, every=0.3),
        }


def test_samples_and_an_end():
    frame = values(Ball, {"v0": [0.0, 1.0, 9.0]})
    flight = 2.0 * np.array([10.0, 11.0, 19.0]) / 9.81
    flight[2] = 3.0  # the longest
    np.testing.assert_allclose(frame["time"], flight, rtol=1e-12)
    last = np.floor(flight[:2] / 0.3) * 0.3
    seen = np.array([10.0, 11.0]) * last - 0.5 * 9.81 * last**2
    np.testing.assert_allclose(frame["seen"][:2], seen, rtol=1e-9)
    np.testing.assert_allclose(frame["twice"], 2.0 * frame["seen"], rtol=1e-12)
    np.testing.assert_array_equal(frame["samples"][:2], 1 + np.floor(flight[:2] / 0.1))
    assert tolstat.trajectory(Ball(), step=0.01)["h"].isna().any()  # after its end


class Timer(Motion):
    """A quantity that switches by a table of time with jumps, and by a period."""

    lasts = 1.0
    x = State("1")
    begin = Part(0.2001, "s")
    total = Response.end("1")
    on = Response.above("s")

    def motion(self, t, y, p):
        pulse = np.where((t > p.begin) & (t < p.begin + 1e-5), 1e5, 0.0)
        steps = np.interp(t, [0.0, 0.5, 0.5, 1.0], [0.0, 0.0, 3.0, 3.0])
        return {
            "x": pulse + steps + (t % 0.1 > 0.075),
            "total": y.x,
            "on": np.sin(40.0 * t) - 0.5,
        }


def test_what_switches_by_time_is_met_however_short():
    frame = values(Timer, {"begin": [0.0, 0.03, 0.29995]})
    np.testing.assert_allclose(frame["total"], 1.0 + 1.5 + 0.25, rtol=1e-9)
    times = np.linspace(0.0, 1.0, 2_000_001)
    on = np.mean(np.sin(40.0 * times) > 0.5)
    np.testing.assert_allclose(frame["on"], on, atol=1e-5)


class Wheel(Motion):
    """A wheel whose load depends on its angle, periodically."""

    lasts = 2.0
    a = State("rad")
    w = State("rad/s", start=9.0)
    turns = Response.end("1")
    end = Response.end("rad/s")

    def motion(self, t, y, p):
        place = y.a % 2.0
        load = np.interp(place, [0.0, 0.5, 0.5, 2.0], [1.0, 2.0, 0.0, 1.0])
        return {"a": y.w, "w": -load, "turns": np.floor(0.5 * y.a), "end": y.w}


def test_a_table_over_an_angle_repeats():
    def rates(t, y):
        place = y[0] % 2.0
        return [y[1], -(1.0 + 2.0 * place if place < 0.5 else (place - 0.5) / 1.5)]

    known = solve_ivp(rates, (0, 2), [0, 9.0], rtol=1e-10, atol=1e-10, max_step=1e-4)
    frame = values(Wheel)
    assert frame["end"][0] == pytest.approx(known.y[1, -1], rel=1e-5)
    assert frame["turns"][0] == known.y[0, -1] // 2.0


class Wrapped(Motion):
    """An angle that grows, and is wrapped."""

    lasts = 10.0
    x = State("1", start=0.1, size=1.0)
    w = Part(1.0, "1")
    area = Response.integral("s")
    greatest = Response.greatest("1")

    def motion(self, t, y, p):
        angle = np.arctan2(np.sin(y.x), np.cos(y.x))
        return {"x": p.w, "area": angle, "greatest": angle}


def test_the_angle_of_arctan2_jumps_by_a_turn():
    w = 1.0 + np.array([0.0, 0.5, -0.3])
    frame = values(Wrapped, {"w": w - 1.0}, max_step=10.0)

    def area(x):  # periodic
        return 0.5 * ((x + np.pi) % (2 * np.pi) - np.pi) ** 2

    exact = (area(0.1 + 10.0 * w) - area(0.1)) / w
    np.testing.assert_allclose(frame["area"], exact, rtol=1e-5)
    np.testing.assert_allclose(frame["greatest"], np.pi, rtol=1e-6)


def test_lanes_never_mix_and_sizes_do_not_depend_on_trials():
    rng = np.random.default_rng(3)
    model = model_of("belt")
    deviations = {
        k: 0.05 * p.nominal * rng.uniform(-1, 1, 11) for k, p in model.parts.items()
    }
    together = tolstat.evaluate(model, deviations)
    for i in (0, 5, 10):
        alone = tolstat.evaluate(model, {k: d[i] for k, d in deviations.items()})
        assert together.iloc[i].tolist() == alone.iloc[0].tolist()


def test_what_finds_the_sizes_is_no_integration_of_a_trial():
    """Its longer steps would miss pushes that those of trials meet."""

    class Pushes(Motion):
        lasts = 2.0
        x = State("1", start=1.0)
        width = Part(0.03, "1")
        T = Part(1.0, "s")
        end = Response.end("1")

        def motion(self, t, y, p):
            s = np.sin(60.0 * t) / p.width
            return {"x": (np.exp(-s * s) - y.x) / p.T, "end": y.x}

    settings = Pushes.settings(max_step=2e-4)
    assert kinks_of(Pushes(), settings) == ()


def test_the_mix_of_what_slides_is_no_branch_of_the_author():
    class Clutch(Motion):
        lasts = 0.5
        wm = State("rad/s", start=150.0)
        a = State("rad")
        wd = State("rad/s")
        J = Part(0.02, "kg m^2")
        k = Part(200.0, "N m/rad")
        T = Part(90.0, "N m")
        heat = Response.integral("J")

        def motion(self, t, y, p):
            slip = y.wm - y.wd
            M = p.T * np.sign(slip)
            F = np.where(y.a > 0.1, p.k * y.a, 0.0)
            return {"wm": -M / p.J, "a": y.wd, "wd": (M - F) / p.J, "heat": M * slip}

    assert kinks_of(Clutch(), Clutch.settings()) == ()


def test_data_count_in_the_digest():
    digests = set()
    for table in ([1.0, 2.0], [1.0, 3.0], [1.0, 3.0]):

        class Tabled(Motion):
            lasts = 1.0
            x = State("1")
            end = Response.end("1")

            def motion(self, t, y, p, table=table):
                return {"x": np.interp(t, [0.0, 1.0], table), "end": y.x}

        digests.add(Tabled().source_digest)
    assert len(digests) == 2


def test_memory_begins_as_given():
    class Relay(Motion):
        lasts = 1.0
        x = State("1", start=0.5)
        end = Response.end("1")
        start = True

        def motion(self, t, y, p):
            on = memory(y.x < 0.0, y.x > 1.0, start=self.start)
            return {"x": np.where(on, 1.0, -1.0), "end": y.x}

    class Other(Relay):
        start = False

    assert values(Relay)["end"][0] == pytest.approx(1.0 - 0.5)
    assert values(Other)["end"][0] == pytest.approx(0.5)


def test_a_history_has_states_and_quantities_and_the_same_outcome():
    moved = tolstat.trajectory(model_of("belt"), {"F": 0.2}, step=1e-3)
    assert moved.attrs["units"] == {"time": "s", "x": "m", "v": "m/s", "pull": "N"}
    responses = moved.attrs["responses"]
    assert moved["pull"].max() == pytest.approx(responses["pull"], rel=1e-5)
    np.testing.assert_allclose(moved["pull"], 50.0 * moved["x"])
