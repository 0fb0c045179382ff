"""The two custom models of the README, as a user runs them."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

import tolstat
from tests.conftest import ROOT
from tolstat.cli.main import main

TOLSTAT = Path(sys.executable).with_name("tolstat")
KINDS = {"stack": "Stack", "oscillator": "Oscillator"}


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """The examples in a folder that knows nothing of the project."""
    folder = tmp_path_factory.mktemp("own") / "own"
    shutil.copytree(
        ROOT / "runs" / "own", folder, ignore=shutil.ignore_patterns("*.h5")
    )
    return folder


def machine_of(folder, name):
    spec = importlib.util.spec_from_file_location(f"own_{name}", folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return getattr(module, KINDS[name])()


def call(folder, *words, code=0):
    """Call a command in this process: it is there already."""
    with contextlib.chdir(folder):
        done = CliRunner().invoke(main, words)
    assert done.exit_code == code, done.output
    return done.stdout + done.stderr


def typed(folder, *words, code=0):
    """Call a command as a shell does, in a process of its own."""
    done = subprocess.run(
        [TOLSTAT, *words], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("name", KINDS)
def test_every_command(own, name):
    machine = ["--machine", f"{name}.py:{KINDS[name]}"]
    # as a shell does; the next ones in this process
    done = typed(own, "run", f"{name}.toml", "--trials", "1000", *machine)
    assert "1000 trials" in done and "verdict" in done
    assert name in call(own, "models", *machine)
    assert "contributors" in call(own, "show", name, *machine)
    assert "bit for bit as stored" in call(own, "trial", f"{name}.h5", "7", *machine)
    call(own, "report", f"{name}.h5")  # the page needs no machine
    page = (own / f"{name}.html").read_text()
    for words in ("Verdict", "worst case, largest", "root sum square", "Worst trials"):
        assert words in page, words
    found = json.loads(call(own, "report", f"{name}.h5", "--json"))
    for each in found["responses"].values():
        assert each["root_sum_square"]["shares"]
    # a new process does not know the machine
    unknown = typed(own, "trial", f"{name}.h5", "7", code=2)
    assert "--machine FILE.py:NAME" in unknown
    # the command beside a worst trial does what it says
    plain = re.sub(r"</?span[^>]*>", "", page)
    (words, *_) = re.findall(r"<code>tolstat (trial [^<]*)</code>", plain)
    assert "--machine" in words  # this process knows the model without it
    assert "bit for bit as stored" in call(own, *words.split())


def test_the_worst_case_of_the_stack_is_the_sum_of_its_tolerances(own):
    machine = machine_of(own, "stack")
    run = tolstat.run(own / "stack.toml", model=machine, output=own / "sum.h5")
    least = run.diagnostics.worst_cases["gap"]["least"]
    largest = run.diagnostics.worst_cases["gap"]["largest"]
    assert largest.value == pytest.approx((0.1 + 0.05 + 3 * 0.03) * 1e-3)
    # the least that can be mounted at all
    assert 0 <= least.value < 0.02e-3 and least.failed > 0
    assert run.diagnostics.slopes["gap"] == pytest.approx(
        {"housing": 1.0, "part_1": -1.0, "part_2": -1.0, "part_3": -1.0}
    )
    sigma = np.sqrt(0.05**2 + 3 * 0.03**2) / 3 * 1e-3
    assert np.nanstd(run.column("gap")) == pytest.approx(sigma, rel=0.02)
    assert set(run.failures) == {"cannot be mounted"}


def test_the_oscillator_against_scipy(own):
    machine = machine_of(own, "oscillator")
    deviations = {"mass": [0.0, 0.02], "stiffness": [0.0, -0.1], "damping": [0.0, 0.3]}
    found = tolstat.evaluate(machine, deviations, {"rtol": 1e-10})
    for i in range(2):
        m, c = 2 * (1 + deviations["mass"][i]), 8000 * (1 + deviations["stiffness"][i])
        b = 16 * (1 + deviations["damping"][i])

        def rates(t, y, m=m, b=b, c=c):
            push = 100.0 if t < 0.02 else 0.0
            return [y[1], (push - b * y[1] - c * y[0]) / m, b * y[1] ** 2]

        known = solve_ivp(
            rates, (0, 0.5), [0, 0, 0], rtol=1e-10, atol=1e-13, max_step=1e-4
        )
        assert found["peak"][i] == pytest.approx(np.abs(known.y[0]).max(), rel=1e-5)
        assert found["lost"][i] == pytest.approx(known.y[2, -1], rel=1e-5)
        assert found["frequency"][i] == pytest.approx(np.sqrt(c / m) / 2 / np.pi)
    moved = tolstat.trajectory(machine, {"damping": 0.3})
    assert moved.attrs["units"] == {"time": "s", "peak": "m", "speed": "m/s"}
    assert moved["peak"].abs().max() == pytest.approx(moved.attrs["responses"]["peak"])


def test_a_file_without_the_named_model_lists_its_models(own, tmp_path):
    for place, words in (
        ("stack.py:Stuck", "did you mean 'Stack'"),
        ("stack.py", "FILE.py:NAME is expected"),
        ("stock.py:Stack", "stock.py: no such file"),
        ("stack.toml:Stack", "is not a Python file"),
        ("stack.py:Settings", "is not a model"),
    ):
        assert words in call(own, "run", "stack.toml", "--machine", place, code=2)
    (tmp_path / "broken.py").write_text("import nonsense\n")
    place = f"{tmp_path / 'broken.py'}:Broken"
    said = call(own, "show", "stack", "--machine", place, code=2)
    assert "ModuleNotFoundError: No module named 'nonsense'" in said
    assert "Traceback" not in said


def test_a_study_never_names_code(own):
    study = {"model": "stack.py:Stack", "trials": 3, "seed": 1}
    with pytest.raises(tolstat.errors.StudyError, match="no model is called"):
        tolstat.run(study, output=own / "never.h5")


def test_an_installed_package_provides_a_model(tmp_path):
    """An entry point of the group tolstat.machines, without installing anything."""
    (tmp_path / "brought.py").write_text(
        (ROOT / "runs" / "own" / "stack.py").read_text().replace('"stack"', '"brought"')
    )
    info = tmp_path / "brought-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: brought\nVersion: 1.0\n"
    )
    (info / "entry_points.txt").write_text(
        "[tolstat.machines]\nbrought = brought:Stack\n"
    )
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]);"
        "import tolstat; print(tolstat.models());"
        "print(tolstat.evaluate('brought', {'housing': 1e-5})['gap'][0])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "'brought'" in done.stdout and "0.00011" in done.stdout
