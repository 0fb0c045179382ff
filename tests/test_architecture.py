"""Layers of the package, and lazy imports."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_layers_import_only_lower_layers():
    found = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout


PLANTED = [
    (
        "machines/ring/__init__.py",
        "from tolstat.machines.stand import motion",
        "a machine knows no other machine",
    ),
    (
        "machines/ring/near.py",
        "import tolstat.lanes.rows",
        "a machine reaches the integrator by its face",
    ),
    ("model/late.py", "import tolstat.catalogue", "floors import only downward"),
    (
        "execution/drawn.py",
        "import matplotlib",
        "matplotlib and jinja2 only where answers are drawn",
    ),
    ("study/read.py", "import tolstat.store.stored_run", "floors import only downward"),
    (
        "render/again.py",
        "import tolstat.execution.workers.block_scheduler",
        "floors import only downward",
    ),
    (
        "render/known.py",
        "import tolstat.study.study",
        "a report is made of the run's file alone",
    ),
    ("model/file.py", "import h5py", "HDF5 only in store"),
    ("at_the_top.py", "import h5py", "HDF5 only in store"),
    ("answers/far.py", "import distributed", "Dask only where blocks are executed"),
    ("study/unit.py", "import pint", "pint only in units"),
    ("store/shown.py", "import rich", "the command line's libraries stay there"),
    ("store/checked.py", "import pydantic", "pydantic and TOML writing only in study"),
    (
        "statistics/unit.py",
        "import tolstat.units.scale",
        "the integrator and the statistics know no unit",
    ),
]


def broken(shown):
    """Modules that break each contract, as import-linter lists them at the end."""
    parts = re.split(r"^(.+)\n-+\n", shown.partition("Broken contracts")[2], flags=re.M)
    return {
        name: sorted(re.findall(r"^- +(\S+) -> ", part, re.MULTILINE))
        for name, part in zip(parts[1::2], parts[2::2], strict=True)
    }


def test_each_planted_import_is_caught_by_its_contract_alone(tmp_path):
    """Contracts that cannot fail keep nothing."""
    shutil.copytree(
        ROOT / "tolstat", tmp_path / "tolstat", ignore=shutil.ignore_patterns("__pyc*")
    )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    expected = defaultdict(list)
    for file, line, contract in PLANTED:
        planted = tmp_path / "tolstat" / file
        planted.write_text(f'"""Planted."""\n\n{line}  # noqa: F401\n')
        module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        expected[contract].append(f"tolstat.{module}")
    found = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert found.returncode == 1
    assert broken(found.stdout) == {k: sorted(v) for k, v in expected.items()}


def printed(code):
    """Run code in a process of its own; return what it prints."""
    found = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return found.stdout.strip()


def test_importing_tolstat_loads_no_heavy_package():
    code = (
        "import sys, tolstat, tolstat.cli.main;"
        "heavy = {'numba', 'pandas', 'pint', 'scipy', 'h5py', 'pydantic', 'tomli_w'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    assert printed(code) == "[]"


def test_the_list_of_commands_loads_no_command():
    code = (
        "import sys; from tolstat.cli.main import main;"
        "main(['--help'], standalone_mode=False); print();"
        "print([n for n in sys.modules if n in ('rich', 'numpy') or 'cli.run' in n])"
    )
    assert printed(code).splitlines()[-1] == "[]"


def test_describing_a_model_does_not_load_the_compiler():
    code = (
        "import sys; from tolstat.study.study import load; load('runs/khpt75.toml');"
        "print('numba' in sys.modules)"
    )
    assert printed(code) == "False"


def test_a_run_begins_before_slow_scipy_modules_load():
    code = (
        "import sys, tolstat.cli.run, tolstat.execution.execute;"
        "from tolstat.study.study import load; load('runs/khpt75.toml');"
        "slow = ('integrate', 'optimize', 'sparse', 'spatial', 'stats');"
        "print([name for name in slow if f'scipy.{name}' in sys.modules])"
    )
    assert printed(code) == "[]"


def test_no_test_file_imports_another():
    """What two of them need has a file of its own."""
    imports = re.compile(r"^ *(?:from|import) tests\.(?:\w+\.)*test_", re.MULTILINE)
    files = Path("tests").rglob("*.py")
    assert not [str(file) for file in files if imports.search(file.read_text())]


MOST_LOADED = 130  # modules of a chain's run: 100 are the aim


def test_running_a_chain_loads_what_it_needs(tmp_path):
    """From the command line, with its summary; packages are not counted."""
    code = (
        "import sys; from tolstat.cli.main import main;"
        f"main(['run', 'runs/stack-up.toml', '-o', {str(tmp_path / 'a.h5')!r},"
        "'--trials', '200'], standalone_mode=False); print();"
        "loaded = {n: m for n, m in sys.modules.items() if n.startswith('tolstat.')};"
        "print(*(n for n, m in loaded.items() if not hasattr(m, '__path__')))"
    )
    loaded = printed(code).splitlines()[-1].split()
    assert len(loaded) <= MOST_LOADED
    assert not {"tolstat.cli.check", "tolstat.render.page"} & {*loaded}
