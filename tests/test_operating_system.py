"""A computer whose system lacks what Windows lacks: a study runs all the same."""

from __future__ import annotations

import ast
import subprocess
import sys

from tests.conftest import ROOT

# modules and functions that Python has on POSIX systems alone
MODULES = (
    "fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios",
    "tty",
)  # fmt: skip
FUNCTIONS = {
    "os": (
        "O_NOFOLLOW", "O_NONBLOCK", "chown", "fchmod", "fchown", "fork", "forkpty",
        "geteuid", "getgid", "getloadavg", "getpgid", "getuid", "killpg", "lchown",
        "mkfifo", "nice", "pread", "preadv", "pwrite", "pwritev", "register_at_fork",
        "sched_getaffinity", "sched_setaffinity", "setsid", "sysconf", "uname", "wait",
    ),
    "signal": ("SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "alarm", "pause"),
    "time": ("clock_gettime", "tzset"),
}  # fmt: skip
HOME = ROOT / "tolstat" / "operating_system.py"
# other libraries are loaded before anything is taken away: they have versions for
# Windows, which a test on another system cannot load
WITHOUT = f"""
import os, signal, sys, time
import h5py, llvmlite.binding, matplotlib.pyplot, numba, pandas, pint, portalocker
import platformdirs, psutil, pydantic, rich.console, scipy.stats, tomli_w
for name in {MODULES}:
    sys.modules[name] = None
for module, names in {FUNCTIONS}.items():
    for name in names:
        vars(sys.modules[module]).pop(name, None)
from tolstat.cli.entry import entry
sys.argv[0] = "tolstat"
entry()
"""


def tolstat_without(*arguments):
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def test_a_study_runs_and_is_reported(tmp_path):
    run, page = tmp_path / "gap.h5", tmp_path / "gap.html"
    ended = tolstat_without("run", "runs/stack-up.toml", "--trials", 500, "-o", run)
    assert ended.returncode == 0, ended.stderr
    ended = tolstat_without("report", run, "-o", page)
    assert ended.returncode == 0, ended.stderr
    assert "Axial gap" in page.read_text()
    ended = tolstat_without("extend", run, "--trials", 600)
    assert ended.returncode == 0, ended.stderr


def test_one_file_knows_systems():
    for path in (ROOT / "tolstat").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())) if path != HOME else ():
            match node:
                case ast.Import(names=names):
                    modules = {alias.name for alias in names}
                case ast.ImportFrom(module=str(module)):
                    modules = {module}
                case ast.Attribute(value=ast.Name(id=module), attr=name):
                    assert name not in FUNCTIONS.get(module, ()), (path, module, name)
                    continue
                case _:
                    continue
            assert not modules & {*MODULES}, (path, modules)
