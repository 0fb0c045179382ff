"""A computer whose system lacks what Windows lacks: a study runs all the same."""

from __future__ import annotations

import ast
import json
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
import json, os, signal, sys, time
import h5py, llvmlite.binding, matplotlib.pyplot, numba, pandas, pint, portalocker
import platformdirs, psutil, pydantic, rich.console, scipy.stats, tomli_w
for name in {MODULES}:
    sys.modules[name] = None
for module, names in {FUNCTIONS}.items():
    for name in names:
        vars(sys.modules[module]).pop(name, None)
from tolstat.cli.entry import entry
for command in json.loads(sys.argv[1]):
    sys.argv = ["tolstat", *command]
    try:
        entry()
    except SystemExit as ended:
        assert not ended.code, command
"""


def test_a_study_runs_and_is_reported(tmp_path):
    run, page = str(tmp_path / "gap.h5"), tmp_path / "gap.html"
    commands = [
        ["run", "runs/stack-up.toml", "--trials", "500", "-o", run],
        ["report", run, "-o", str(page)],
        ["extend", run, "--trials", "600"],
    ]
    command = [sys.executable, "-c", WITHOUT, json.dumps(commands)]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "Axial gap" in page.read_text()
    assert "600 trials done" in ended.stdout


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
