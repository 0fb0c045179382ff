"""What the compiler is told, in processes with other environments."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

SAID = (
    "from pathlib import Path\n"
    "from tolstat.lanes import cache\n"
    "from tolstat.lanes.cache import machine_code\n"
    "print(machine_code())\n"
    "print(cache.cache_folder(Path(cache.__file__), 'cache'))\n"
)


def said(folder, **environment):
    """Return machine code and folder of its cache, in a process of its own."""
    mine = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    mine["NUMBA_CACHE_DIR"] = str(folder)
    done = subprocess.run(
        [sys.executable, "-c", SAID], env={**mine, **environment}, text=True,
        capture_output=True, check=True,
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    return said(tmp_path_factory.mktemp("cache"))


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("NUMBA_CPU_NAME", "generic", " generic, "),
        ("NUMBA_CPU_FEATURES", "", ", features "),
        ("NUMBA_OPT", "1", "level 1, "),
        ("NUMBA_SLP_VECTORIZE", "1", "level 2, "),
        ("NUMBA_DISABLE_JIT", "1", "NUMBA_DISABLE_JIT"),
    ],
)
def test_other_orders_to_the_compiler_are_other_machine_code(
    usual, tmp_path, name, value, word
):
    code, folder = said(tmp_path, **{name: value})
    assert code != usual[0] and word in code
    assert folder.split("/")[-2] != usual[1].split("/")[-2]


def test_the_level_is_ours_where_a_user_asks_for_more(usual, tmp_path):
    assert said(tmp_path, NUMBA_OPT="3")[0] == said(tmp_path, NUMBA_OPT="2")[0]
    assert "level 2, " in usual[0]
