"""Environments, limits and closed streams: how each command ends in them.

    python -m tests.studies.attacks.surroundings [SURROUNDINGS [COMMAND]]

Both are patterns of their names; default: all. A command may end in an answer or a
sentence, not in a traceback, by a signal or after a minute, and leaves no file beside
its answers. The exit code is 1 if anything is wrong.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.cli.command_line import TOLSTAT, chain

SECONDS = 60.0  # generous, for a busy computer
CODES = (0, 1, 2, 3, 4)
# what the environment has; None removes a name
ENVIRONMENTS = {
    **{f"TZ={zone}": {"TZ": zone} for zone in ("UTC+24", "UTC-99:99", ":/etc/passwd")},
    **{f"NUMBA_NUM_THREADS={n}": {"NUMBA_NUM_THREADS": n} for n in ("0", "9999")},
    **{f"{n}=x": {n: "x"} for n in ("NUMBA_CPU_NAME", "MPLBACKEND", "OMP_NUM_THREADS")},
    **{f"COLUMNS={n}": {"COLUMNS": n} for n in ("0", "-5", "x")},
    "a broken DASK_CONFIG": {"DASK_CONFIG": "dask.yaml"},
    "no cache": {"NUMBA_CACHE_DIR": "/etc/passwd", "MPLCONFIGDIR": "/etc/passwd"},
    "no home": {"HOME": "/nonexistent", "NUMBA_CACHE_DIR": None},
    "no TMPDIR": {"TMPDIR": "/nonexistent"},
    "no environment": dict.fromkeys(os.environ),
    "LC_ALL=C": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "ascii": {"PYTHONIOENCODING": "ascii"},
    "TERM=dumb": {"TERM": "dumb"},
    "PYTHONOPTIMIZE=2": {"PYTHONOPTIMIZE": "2"},
    "PYTHONWARNINGS=error": {"PYTHONWARNINGS": "error"},
}
# what a shell does before the command
SHELL = {
    "stdout closed": "exec >&-",
    "stderr closed": "exec 2>&-",
    "all closed": "exec <&- >&- 2>&-",
    "stdout full": "exec > /dev/full",
    "folder removed": "mkdir gone; cd gone; rmdir ../gone",
    "files of 0 bytes": "ulimit -f 0",
    "30 open files": "ulimit -n 30",
    "100 MB of data": "ulimit -d 100000",
    "a driver HDF5 does not know": "export HDF5_DRIVER=x",
    "a time that is none": "export SOURCE_DATE_EPOCH=x",
    **{f"{mb} MB": f"ulimit -v {mb}000" for mb in (350, 600, 1000, 1500)},
}
COMMANDS = (
    "--help", "run --help", "models", "new dimension_chain -o new.toml", "runs",
    "run a.toml --force --trials 500", "batch a.toml", "show a.h5", "check a.h5",
    "report a.h5 -o a.html", "export a.h5 -o a.csv", "what-if a.h5 A=+-0.05mm",
    "trial a.h5 0",
)  # fmt: skip
ANSWERS = {
    "a.toml", "a.h5", "a.html", "a.csv", "batch.html", "batch.csv", "new.toml",
    "dask.yaml",
}  # fmt: skip


def wrong_in(folder: Path, surroundings: str, command: str) -> tuple[str, str]:
    """Return what is wrong after a command, empty if nothing is; and its last words."""
    changes = ENVIRONMENTS.get(surroundings, {})
    environment = {k: v for k, v in {**os.environ, **changes}.items() if v is not None}
    before = SHELL.get(surroundings, "true")
    line = ["/bin/bash", "-c", f'{before}; exec "$@"', "", TOLSTAT, *command.split()]
    try:
        ended = subprocess.run(
            line, cwd=folder, env=environment, capture_output=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return "hang", ""
    words = (ended.stdout + ended.stderr).decode(errors="replace")
    left = {path.name for path in folder.iterdir()} - ANSWERS
    problems = {
        "traceback": "Traceback" in words,
        f"code {ended.returncode}": ended.returncode not in CODES,
        f"left: {', '.join(sorted(left))}": bool(left),
    }
    return "; ".join(filter(problems.get, problems)), " ".join(words.split())[-200:]


def main(words: list[str]) -> int:
    """Print what is wrong, and counts."""
    places, commands = [*words, "", ""][:2]
    counts = Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        origin = Path(name) / "origin"
        origin.mkdir()
        (origin / "dask.yaml").write_text("a: [\n b: }")
        study = chain(origin, "a")
        subprocess.run([TOLSTAT, "run", study], check=True, capture_output=True)
        for surroundings in filter(re.compile(places).search, [*ENVIRONMENTS, *SHELL]):
            for command in filter(re.compile(commands).search, COMMANDS):
                folder = Path(shutil.copytree(origin, Path(name) / "copy"))
                problem, last = wrong_in(folder, surroundings, command)
                counts[problem or "answer or sentence"] += 1
                if problem:
                    print(
                        f"{problem} | {surroundings} | {command} | {last}", flush=True
                    )
                shutil.rmtree(folder)
    print(f"{counts.total()} commands: {dict(counts)}")
    return int(counts.keys() != {"answer or sentence"})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
