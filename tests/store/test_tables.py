"""Diagnostics of a run are few arrays, however many parts and limits it has."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import tolstat
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response


class Stack(Model):
    name = "stack"
    title = "heights of the faces in a stack of plates"

    def __init__(self, plates):
        self.plates = plates

    def describe(self, settings):
        numbers = range(1, self.plates + 1)
        return Description(
            tuple(Contributor(f"plate_{i}", "m") for i in numbers),
            tuple(Response(f"height_{i}", "m") for i in numbers),
        )

    def evaluate(self, deviations, settings):
        heights = np.cumsum(deviations, axis=1)
        return Outcome(heights, np.ones(len(heights), np.int64))


def stored(plates, folder):
    """Return a run of so many limits, and the names under its diagnostics."""
    study = {
        "model": "stack",
        "trials": 300,
        "seed": 1,
        "deviations": {"plate": "+-0.01 mm"},
        "limits": {f"height_{i}": "<= 0.012 mm" for i in range(1, plates + 1)},
    }
    path = folder / f"{plates}.h5"
    run = tolstat.run(study, model=Stack(plates), output=path)
    objects = []
    with h5py.File(path) as file:
        file["diagnostics"].visititems(lambda name, _: objects.append(name))
    return run, objects


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stacks")
    return [stored(plates, folder) for plates in (3, 12)]


def test_their_number_does_not_grow_with_parts_and_limits(two_runs):
    (_, few), (_, many) = two_runs
    assert sorted(few) == sorted(many)
    assert len(many) <= 20


def test_what_is_read_is_what_was_computed(two_runs):
    run, _ = two_runs[1]
    diagnostics = run.diagnostics
    assert [*diagnostics.slopes] == [f"height_{i}" for i in range(1, 13)]
    assert [*diagnostics.slopes["height_2"]] == [f"plate_{i}" for i in range(1, 13)]
    assert diagnostics.slopes["height_2"]["plate_2"] == pytest.approx(1.0)
    case = diagnostics.worst_cases["height_3"]["largest"]
    assert case.value == pytest.approx(3e-5) and isinstance(case.tried, int)
    assert case.deviations["plate_1"] == pytest.approx(1e-5)
    halved = diagnostics.halved["height_12"]
    assert {("plate_1",), tuple(f"plate_{i}" for i in range(1, 13))} <= {*halved}
    assert isinstance(halved["plate_1",].beyond.reason, str)


def test_plain_h5py_reads_an_array_over_its_keys(two_runs):
    run, _ = two_runs[0]
    with h5py.File(run.path) as file:
        slopes = file["diagnostics/slopes"]
        values = slopes["value"]
        assert values.shape == (3, 3)
        assert [dimension[0].name.split("/")[-1] for dimension in values.dims] == [
            "response",
            "contributor",
        ]
        assert slopes["response"].asstr()[:].tolist() == [*run.diagnostics.slopes]
        assert slopes.attrs["long_name"]
