"""Units that a study types are those of its answers, views and histories."""

from __future__ import annotations

import csv
import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

import tolstat
from tolstat.answers.views.evaluate import view_of
from tolstat.answers.views.replay import nominal_trial, replay
from tolstat.answers.views.view_file import as_csv
from tolstat.cli.main import main
from tolstat.document.view_content import plot_of
from tolstat.study.study import load, typed_units


def study_of(name, **changes):
    """Return a study of the gallery with other entries."""
    study = tomllib.loads(Path("runs", name).read_text())
    for section, entries in changes.items():
        study[section] |= entries
    return study


def heads_of(view):
    return next(csv.reader([as_csv(view).partition("\n")[0]]))


def test_a_speed_is_drawn_as_it_is_typed():
    study = study_of(
        "rolling-block.toml",
        settings={"speed_range": "89..178 rad/s", "working_speed": "115 rad/s"},
        limits={"free_speed_range": {"limit": ">= 42 rad/s", "yield": "95 %"}},
    )
    loaded = load(study)
    view = view_of(loaded.model, loaded.settings, "campbell", study=loaded)
    assert heads_of(view)[0] == "motor speed [rad/s]"
    assert plot_of(view).panels[0].x.label.startswith("motor speed, rad/s")
    listing = view_of(loaded.model, loaded.settings, "resonances", study=loaded)
    assert {"critical speed [rad/s]", "from [rad/s]", "to [rad/s]"} < set(
        heads_of(listing)
    )
    # as the model declares it, where entries disagree
    study["settings"]["working_speed"] = "1100 rpm"
    loaded = load(study)
    view = view_of(loaded.model, loaded.settings, "campbell", study=loaded)
    assert heads_of(view)[0] == "motor speed [rpm]"


def test_bands_have_the_unit_of_their_curve():
    study = study_of(
        "ring.toml", settings={"speed": "5 rpm", "speed_range": "0..60 rpm"}
    )
    study["limits"]["flutter_speed"] = ">= 50 rpm"
    loaded = load(study)
    view = view_of(loaded.model, loaded.settings, "spectrum", study=loaded)
    heads = heads_of(view)
    assert heads[0] == "speed [rpm]"
    bands = [head for head in heads if head.startswith("frequency 1")]
    assert len(bands) == 3 and all(head.endswith("[rpm]") for head in bands)


def test_a_history_has_the_units_of_limits(tmp_path):
    study = study_of(
        "elastic-machine.toml",
        limits={"error_4": "<= 15 deg", "torque_peak_1": "<= 95000 N mm"},
    ) | {"trials": 3}
    run = tolstat.run(study, output=tmp_path / "run.h5")
    assert run.scales["error_4"].shown == "deg"
    for found in (replay(run.path, 1), nominal_trial(load(study))):
        heads = heads_of(found.history)
        assert {"error_4 [deg]", "torque_peak_1 [N mm]", "torque_peak_2 [N m]"} < set(
            heads
        )
        assert found.responses["error_4"].scale.shown == "deg"
    # one axis has one unit: that typed for any of its curves
    labels = {panel.y.label for panel in plot_of(found.history).panels}
    assert "deg" in labels and "mrad" in labels


def test_a_response_without_a_unit_has_that_of_its_kind(tmp_path):
    link = {"nominal": "1.5 in", "tolerance": "+-0.004 in"}
    study = {
        "model": "dimension_chain", "trials": 8, "seed": 1,
        "settings": {"gap": "a - b"}, "links": {"a": link, "b": link},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "inch.h5")
    assert run.scales["gap"].shown == "in"
    study["links"] = {"a": link, "b": {"nominal": "30 mm", "tolerance": "+-0.1 mm"}}
    run = tolstat.run(study, output=tmp_path / "mixed.h5")
    assert run.scales["gap"].shown == "mm"


@pytest.mark.parametrize(
    ("sections", "units"),
    [
        ({"settings": {"a": "5 rpm", "b": "0..60 rpm", "c": 3}}, ["rpm"]),
        ({"settings": {"a": "5 rpm"}, "limits": {"b": "<= 3 rad/s"}}, []),
        ({"settings": {"a": ["900 N m/rad", "7 N m/rad"]}}, ["N m/rad"]),
        ({"deviations": {"a": "+-1 mm", "b": {"tolerance": "+-1 deg"}}}, []),
        ({"links": {"a": {"nominal": "2 in", "tolerance": "+-0.1 in"}}}, ["in"]),
        ({"settings": {"gap": "2 * a", "word": "3 blind mice"}}, []),
    ],
)
def test_units_of_kinds_are_those_on_which_all_entries_agree(sections, units):
    assert list(typed_units(sections).values()) == units


def test_contributors_are_listed_in_units_of_drawings():
    said = CliRunner().invoke(main, ["show", "stand"]).output
    rows = dict(re.findall(r"^ *(\w+) +(\S+) ", said, re.MULTILINE))
    names = "rod_length_1", "crank_angle_1", "friction", "rod_force_1", "runout_7"
    assert [rows[name] for name in names] == ["mm", "deg", "%", "kN", "mm"]
    said = CliRunner().invoke(main, ["show", "planetary"]).output
    assert "gear of 96.74 mm" in said and not re.search(r"gear of \d+\.\d{3}", said)


def test_a_view_in_a_compound_unit_belongs_to_a_study_too():
    compliance = tolstat.view("runs/elastic-machine.toml", "response")
    assert [panel.y.label for panel in plot_of(compliance).panels] == ["rad/N/m", "s^2"]
