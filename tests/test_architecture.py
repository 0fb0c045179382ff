"""The floors hold."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_floors():
    found = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout


def test_importing_tolstat_and_its_command_line_loads_nothing_heavy():
    code = (
        "import sys, tolstat, tolstat.cli.main;"
        "heavy = {'numba', 'pandas', 'pint', 'scipy', 'h5py', 'pydantic'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"


def test_describing_a_model_does_not_load_the_compiler():
    code = (
        "import sys; from tolstat.study.study import load; load('runs/khpt75.toml');"
        "print('numba' in sys.modules)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.strip() == "False"
