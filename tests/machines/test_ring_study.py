"""The ring's studies as shipped, and its views."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines.ring_reference import DEG
from tolstat.answers.sweep.extremes_document import comparisons
from tolstat.errors import ModelError, StudyError
from tolstat.machines.ring import spectrum

FIGURES = {
    "radius": 3.0,
    "thickness": 0.05,
    "support_angle": 40 * DEG,
    "duration": 0.05,
}


def shown(cell):
    (number,) = cell.main
    return float(number.scale.number(number.value))


def test_the_table_by_the_study_that_is_shipped(tmp_path):
    """Each cell beside its print, the curve of its own stiffness."""
    run = tolstat.run("runs/ring-table.toml", output=tmp_path / "table.h5")
    found = [*comparisons(run)]
    assert [len(each.rows) for each in found] == [6, 6, 6]
    differences = [shown(row[3]) for each in found for row in each.rows]
    assert len(differences) == 18 and np.abs(differences).max() < 0.01
    printed = [shown(each.rows[0][1]) for each in found]
    assert printed == [-0.06, 1.2, 1.48]


def test_the_study_of_tolerances(tmp_path):
    run = tolstat.run("runs/ring.toml", trials=64, output=tmp_path / "ring.h5")
    assert run.counts["done"] == 64
    assert run.nominal["depth_min"] == pytest.approx(1.340e-3, abs=2e-6)
    assert run.column("depth_min").std() > 5e-5


def test_with_hoop_tension_there_is_no_critical_speed():
    study = {"model": "ring", "trials": 8, "seed": 1, "deviations": {"depth": "+-1 mm"}}
    study["settings"] = {"hoop": True}
    study["limits"] = {"flutter_speed": ">= 5 rad/s"}
    with pytest.raises(StudyError, match="flutter_speed"):
        tolstat.run(study)


def test_the_view_of_the_spectrum():
    settings = {**FIGURES, "ring_damping": 0.0, "speed_range": (0.0, 24.0)}
    settings |= {"varied": "radius", "varied_by": [1.0, 1.25]}
    frame = tolstat.view("ring", "spectrum", None, settings).frame()
    known = spectrum(frame.index.to_numpy(), settings)
    np.testing.assert_allclose(frame["frequency 1"], known.frequency)
    np.testing.assert_allclose(frame["growth"], known.growth)
    wider = spectrum(frame.index.to_numpy(), {**settings, "radius": 3.75})
    np.testing.assert_allclose(frame["radius 3.75 m"], wider.frequency)
    np.testing.assert_allclose(frame["growth, radius 3.75 m"], wider.growth)


def test_the_view_of_stability():
    settings = {**FIGURES, "speed_range": (0.0, 24.0), "varied": "tool_stiffness"}
    chart = tolstat.view("ring", "stability", None, settings)
    frame = chart.frame()
    for speed in frame.index[[3, 90]]:
        row = tolstat.evaluate("ring", None, {**settings, "speed": speed}).iloc[0]
        found = frame.loc[speed, "ring and tool"]
        assert found == pytest.approx(row["growth_rate"], rel=1e-9)
    # 2 sqrt nu = 16.64 rad/s: beyond, nothing rests
    assert (frame["ring and tool"].isna().to_numpy() == (frame.index > 16.6429)).all()
    assert chart.panels[0].spans[0].lower == pytest.approx(18.327284, abs=1e-6)
    [work] = chart.panels[1].spans  # the others flutter elsewhere
    assert work.words == "speed as set"
    assert len([name for name in frame if name.startswith("tool stiffness")]) == 3


def test_impossible_values_are_named():
    wide = {"support_angle": np.radians(130.0)}
    chart = tolstat.view("ring", "spectrum", None, wide)
    assert chart.panels[1].title == "Lowest frequency, 195 deg impossible"
    assert [name.partition(" ")[2] for name in chart.panels[1].names] == [
        "angle 65 deg",
        "angle 130 deg",
    ]


@pytest.mark.parametrize("speeds", [[1.0, np.nan], [1e200], [[1.0, 2.0], [3.0, 4.0]]])
def test_wrong_speeds_are_refused(speeds):
    with pytest.raises(ModelError, match="numbers in a row"):
        spectrum(speeds)
