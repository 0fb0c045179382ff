"""FMUs, built once a session; their processes use a cache of their own."""

from __future__ import annotations

import shutil

import pytest

from tests.fmu.building import build, build_reference
from tolstat import catalogue


@pytest.fixture(scope="session")
def _folder(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("gcc is missing")
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session")
def built(_folder):
    """The path of an FMU of ours, by name and version of FMI."""
    return _once(build, _folder)


@pytest.fixture(scope="session")
def reference(_folder):
    """The path of a Reference-FMU of the Modelica Association."""
    folder = _folder / "reference"
    folder.mkdir()
    return _once(build_reference, folder)


def _once(maker, folder):
    made = {}

    def path(name, fmi=2):
        if (name, fmi) not in made:
            made[name, fmi] = maker(name, fmi, folder)
        return made[name, fmi]

    return path


@pytest.fixture
def model(built):
    """Load an FMU of ours as --machine does."""
    return lambda name, fmi=2: catalogue.load(str(built(name, fmi)))
