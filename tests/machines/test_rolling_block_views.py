"""Views of the rolling block, against its responses."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex
from scipy.stats import binomtest

import tolstat
from tests.machines import rolling_block_reference as known
from tests.machines.rolling_blocks import FREE, RPM
from tolstat.answers.views.view_file import draw_view, save_view
from tolstat.errors import ModelError

SPREAD = {
    "model": "rolling_block", "trials": 400, "seed": 4,
    "deviations": {"stiffness": "+-15 %", "inertia": "+-6 %"},
}  # fmt: skip


def shown(name, **settings):
    return tolstat.view("rolling_block", name, settings=settings)


def of_study(name, **settings):
    return tolstat.view({**SPREAD, "settings": settings}, name)


def test_the_history_is_the_trial_of_evaluate():
    given = {"horizon": 0.2, "delay": 5e-3}
    deviations = {"stiffness_46": 0.07, "inertia_8": -0.03}
    frame = tolstat.trajectory("rolling_block", deviations, given)
    answers = tolstat.evaluate("rolling_block", deviations, given).iloc[0]
    assert all(answers[name] == v for name, v in frame.attrs["responses"].items())
    for ij in known.LINKS:
        for kind in ("moment_peak", "pulse_peak"):
            top = frame[f"{kind}_{ij}"].abs().max()
            assert top == pytest.approx(answers[f"{kind}_{ij}"], rel=1e-4)


def test_a_drive_that_cannot_exist_has_no_history():
    given = {"horizon": 0.01, "rtol": 1e-6}
    frame = tolstat.trajectory("rolling_block", {"inertia_1": -1.0}, given)
    assert frame.attrs["status"] == "cannot exist"
    assert frame["moment_peak_12"].isna().all()


@pytest.mark.parametrize(("given", "ranges", "total"), FREE)
def test_campbell_shades_the_free_speeds(given, ranges, total):
    chart = shown("campbell", **given)
    *free, work = chart.spans
    assert work.words == "working speed" and work.lower == work.upper == 1200 * RPM
    spans = [(span.lower / RPM, span.upper / RPM) for span in free]
    np.testing.assert_allclose(spans, ranges, atol=5.1e-7)
    frame = chart.frame()
    assert set(frame["resonating"]) == {0.0, 1.0}
    free = (frame["resonating"] == 0).mean() * 850
    assert free == pytest.approx(total, abs=5)
    for r, hz in enumerate(known.HZ, start=1):
        assert (frame[f"mode {r}"] - hz).abs().max() < 1e-8
    at_1200 = frame["order 1"].iloc[np.argmin(abs(frame.index - 1200 * RPM))]
    assert at_1200 == pytest.approx(20.0)


def test_campbell_shows_the_probability_of_resonance():
    """At the working speed: the share of the study's machines within the band."""
    chart = of_study("campbell", working_speed="1130 rpm")
    frame = chart.frame()
    run = tolstat.evaluate(
        "rolling_block", deviations_of(SPREAD), {"horizon": 0.01, "rtol": 1e-6,
                                                 "working_speed": 1130 * RPM},
    )  # fmt: skip
    share = (run["speed_margin"] <= 0.05).mean()
    place = np.argmin(abs(frame.index - 1130 * RPM))
    assert 0.02 < share < 0.98
    assert frame["resonating"].iloc[place] == pytest.approx(share, abs=1e-12)
    lower = frame["mode 1, 5..95 %, lower"].iloc[0]
    assert lower == pytest.approx(np.quantile(run["frequency_1"], 0.05))


def deviations_of(study):
    from tolstat.study.study import load

    table = load(study).deviations()
    names = [f"inertia_{i}" for i in range(1, 10)]
    names += [f"stiffness_{ij}" for ij in known.LINKS]
    return dict(zip(names, table.T, strict=False))


def test_resonances_are_listed_by_speed():
    frame = shown("resonances", rolls=True).frame()
    assert (np.diff(frame["from"]) > 0).all()
    first = frame[frame["excitation"] == "order 1"].iloc[0]
    assert first["critical speed"] / RPM == pytest.approx(60 * known.HZ[0], rel=1e-9)
    assert first["to"] / RPM == pytest.approx(1268.399836, abs=5.1e-7)
    assert first["meets at the working speed"] == 1.0
    none = shown("resonances", meshes=({"teeth": 40, "shaft": "motor"},), orders=(9e3,))
    assert len(none.frame()) == 0


def test_meshes_of_many_teeth_have_no_resonance():
    """First order of 20 teeth and more: above all natural frequencies of Table 1."""
    chart = shown("campbell", orders=(20.0,))
    assert [panel.title for panel in chart.panels] == [
        "Excitations and modes without resonance", "Whether the drive resonates",
        "Rolling speed",
    ]  # fmt: skip
    assert not chart.frame()["resonating"].any()


def test_all_combinations_are_listed():
    frame = shown("combinations").frame()
    assert len(frame) == 128 and frame["combination"].iloc[0] == "0 0 0 0"
    hz = frame[[f"f{r}" for r in range(1, 9)]].to_numpy()
    np.testing.assert_allclose(hz.min(axis=0), known.LEAST_HZ, atol=5.1e-7)
    chosen = frame[frame["combination"] == "0 3 1 1"].iloc[0]
    assert chosen["free speeds"] / RPM == pytest.approx(441.822773, abs=5.1e-7)
    reduced = shown("gearbox").frame().set_index("combination")
    assert reduced.loc["0 3 1 1", "Q1":"Q9"].tolist() == pytest.approx(
        [300, 30, 30, 80, 60, 50, 50, 40, 40]
    )
    assert reduced["sum of Q"].max() == pytest.approx(2196.44, abs=5e-3)
    i31 = reduced.loc["1 3 3 3", "i31"] / reduced.loc["0 3 1 1", "i31"]
    assert reduced.loc["1 3 3 3", "C46"] == pytest.approx(2e6 / i31**2)


def test_the_response_is_as_printed():
    chart = shown("response")
    frame = chart.frame()
    for load, stands in {"32": (32,), "33": (33,), "32 + 33": (32, 33)}.items():
        for hz, (size, phase) in zip(
            known.RESPONSE_HZ, known.RESPONSE[stands], strict=True
        ):
            near = np.interp(hz, frame.index, frame[load])
            assert near == pytest.approx(size, rel=3e-3)
            angle = np.degrees(np.interp(hz, frame.index, frame[f"phase, {load}"]))
            assert angle == pytest.approx(phase, abs=0.7)
    motor = shown("response", response_loads=(1,), response_link="59").frame()
    assert motor["motor"].iloc[0] == pytest.approx(40 / 680, rel=0.1)


def test_poles_and_zeros_are_listed():
    frame = shown("poles").frame()
    both = frame[frame["load"] == "32 + 33"]
    zeros = both.loc[both["what"] == "zero", "frequency"]
    np.testing.assert_allclose(zeros, known.ZEROS[32, 33], atol=5.1e-7)
    cancelled = both.loc[both["what"] == "does not reach", "frequency"]
    np.testing.assert_allclose(cancelled, known.HZ[2:4], atol=1e-8)
    part = both.loc[both["what"] == "pole", "static part a_r"]
    assert part.sum() == pytest.approx(600 / 680)


def test_shapes_are_table_1():
    frame = shown("shapes").frame()
    found = frame[[f"mode {r}" for r in range(1, 9)]].to_numpy()
    np.testing.assert_array_equal(np.round(found, 3) + 0.0, known.TABLE_1)
    spread = of_study("shapes").frame()
    for r in range(1, 9):  # tracked, with the sign of the nominal shape
        lower, upper = (
            spread[f"mode {r}, 5..95 %, {end}"] for end in ("lower", "upper")
        )
        assert (lower - 1e-9 <= spread[f"mode {r}"]).mean() > 0.7
        assert (upper - lower).max() < 0.45


def test_pulses_reach_their_peaks():
    for link, ij in enumerate(known.LINKS):
        frame = shown("pulses", response_link=ij).frame()
        top = frame[f"M{ij}"].abs().max() / 89.8757
        assert top == pytest.approx(known.PULSES[5e-3][link], rel=5e-4)
    frame = shown("pulses").frame()
    for words, length in {"1 ms": 1e-3, "10 ms": 10e-3, "step": 1.0}.items():
        top = frame[words].abs().max() / 89.8757
        assert top == pytest.approx(known.PULSES[length][0], rel=5e-4)


def test_impossible_views_are_refused():
    with pytest.raises(ModelError, match="cannot be built: cannot exist"):
        tolstat.view("rolling_block", "shapes", {"stiffness_34": -1.2})


def test_a_drive_that_does_not_swing_follows_its_pulse():
    frame = shown("pulses", damping_ratio=2.0, response_link="46").frame()
    # it comes from rest, and half the time later it is on its way back
    assert frame["step"].is_monotonic_increasing
    assert frame["M46"].abs().max() < 89.8757


def test_the_response_without_damping_is_finite():
    frame = shown("response", damping_ratio=0.0).frame()
    assert np.isfinite(frame.to_numpy()).all()
    assert frame["32 + 33"].max() < 1e5


def test_shares_of_trials_have_intervals():
    chart = of_study("campbell")
    share, band = chart.curves[-1].values, chart.bands[-1]
    assert band.of == "resonating" and (band.lower <= share).all()
    known = binomtest(0, 400).proportion_ci(method="exact")
    assert share[0] == 0.0 and band.upper[0] == pytest.approx(known.high)
    row = of_study("resonances").frame().iloc[0]
    known = binomtest(
        round(400 * row["meets at the working speed"]), 400
    ).proportion_ci(method="exact")
    assert row["from, 95 %"] == pytest.approx(known.low)
    assert row["to, 95 %"] == pytest.approx(known.high)


def test_a_view_without_resonance_is_plotted():
    figure = draw_view(shown("resonances", orders=(0.01,)), "none")
    (table,) = figure.axes[0].tables
    assert table[1, 0].get_text().get_text() == "none"


def test_a_band_has_the_colour_of_its_curve():
    figure = draw_view(of_study("campbell"), "")
    legend = figure.axes[0].get_legend()
    colours = {
        text.get_text(): to_hex(
            each.get_color() if hasattr(each, "get_color") else each.get_facecolor()
        )
        for text, each in zip(legend.texts, legend.legend_handles, strict=True)
    }
    for mode in ("mode 1", "mode 2", "mode 4"):
        assert colours[mode] == colours[f"{mode}, 5..95 %"]
    assert len({colours[f"mode {r}"] for r in (1, 2, 3, 4)}) == 4


@pytest.mark.parametrize(
    "name", ["campbell", "resonances", "response", "poles", "shapes", "pulses"]
)
def test_every_view_is_drawn(name, tmp_path):
    for view in (shown(name), of_study(name, rolls=True)):
        save_view(view, tmp_path / f"{name}.png", name)
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_a_panel_may_show_more_than_there_are_colours(tmp_path):
    """Slow and fast: one excitation meets all modes, with their bands."""
    view = of_study("campbell", speed_range="800..10000 rpm")
    assert max(len(panel.names) for panel in view.panels) > 12
    save_view(view, tmp_path / "wide.svg", "wide")
    text = (tmp_path / "wide.svg").read_text()
    assert "mathdefault" not in text


def test_logarithmic_axes_have_plain_numbers(tmp_path):
    save_view(shown("response"), tmp_path / "response.svg", "response")
    assert "mathdefault" not in (tmp_path / "response.svg").read_text()
