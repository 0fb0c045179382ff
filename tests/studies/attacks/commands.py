"""Commands of tolstat in forks of one warm process, each with bounds.

A fork takes milliseconds where a start takes a second. The child is as `tolstat` from
the shell: it has the signals, the exit code and both streams of that.
"""

from __future__ import annotations

import contextlib
import os
import pkgutil
import re
import resource
import select
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

SECONDS, BYTES = 10.0, 1_500_000_000  # most of a command: of a processor, of memory
LOOK, ASLEEP = 0.5, 3.0  # s: between two looks; without any work, it hangs
LARGEST = 500_000_000  # bytes of a file that it may write
UNCAUGHT = 70  # exit code of an exception that reaches the interpreter
STUDY = """\
model = "dimension_chain"
trials = 200
seed = 3
settings.gap = "A - B"
links.A = { nominal = "10 mm", tolerance = "+-0.1 mm" }
links.B = { nominal = "9 mm", tolerance = "+-0.1 mm" }
limits.gap = ">= 0.8 mm"
"""


class Outcome(NamedTuple):
    """How a command ended."""

    code: int  # negative: the signal
    text: str  # of both streams
    seconds: float
    memory: int  # bytes, at most
    hangs: bool

    @property
    def kind(self) -> str:
        """A word for how it ended; `worked` and `sentence` are as they should be."""
        if self.hangs:
            return "hang"
        if self.code < 0:
            return f"signal {signal.Signals(-self.code).name}"
        if self.code == UNCAUGHT or "Traceback (most" in self.text:
            return "traceback"
        if self.memory > BYTES or "not enough memory" in self.text:
            return "memory"
        if self.code in (0, 3, 4):
            return "worked"
        return "sentence" if self.text.strip() else "no sentence"

    @property
    def last_line(self) -> str:
        """The last line that says something."""
        return next((x for x in self.text.splitlines()[::-1] if x.strip()), "")[:300]


def warm() -> None:
    """Load what commands load, and run each once: a fork has it all."""
    import tolstat

    for module in pkgutil.walk_packages(tolstat.__path__, "tolstat."):
        if not module.name.startswith("tolstat.machines."):  # some are compiled
            import_module(module.name)
    from click.testing import CliRunner

    from tolstat.cli.main import main

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("a.toml").write_text(STUDY)
        Path("b.toml").write_text(STUDY.replace("seed = 3", "seed = 4"))
        for words in (
            "run a.toml", "batch a.toml b.toml", "report a.h5", "verify a.h5",
            "compare a.h5 b.h5", "what-if a.h5 A=+-0.05mm", "export a.h5 -o a.csv",
            "trial a.h5 3 --plot a.png", "extend a.h5 --trials 300", "check a.h5",
        ):  # fmt: skip
            CliRunner().invoke(main, words.split())
    assert threading.active_count() == 1, threading.enumerate()


def ask(
    words: str,
    folder: Path,
    *,
    before: Callable[[], object] = lambda: None,
    seconds: float = SECONDS,
) -> Outcome:
    """Carry out one command in a folder; `before` is called in its process first."""
    with tempfile.TemporaryFile() as out:
        began = time.monotonic()
        child = os.fork()
        if not child:
            _run(words.split(), folder, out.fileno(), before)
        hangs = not _ends(child, seconds)
        with contextlib.suppress(ProcessLookupError):  # also what it started
            os.killpg(child, signal.SIGKILL)
        _, status, usage = os.wait4(child, 0)
        out.seek(0)
        text = out.read(2_000_000).decode(errors="replace")
    code = os.waitstatus_to_exitcode(status)
    spent = time.monotonic() - began
    return Outcome(code, text, spent, usage.ru_maxrss * 1024, hangs)


def _ends(child: int, seconds: float) -> bool:
    """Wait for a process; False if it computes too long, or sleeps without end.

    Its own time counts: others may be at work on the same processors.
    """
    fd, quiet, spent = os.pidfd_open(child), 0.0, -1.0
    while not (ends := bool(select.select([fd], [], [], LOOK)[0])):
        fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
        before, spent = spent, sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
        quiet = quiet + LOOK if fields[0] in "SD" and spent == before else 0.0
        if quiet >= ASLEEP or spent >= seconds:
            break
    os.close(fd)
    return ends


def _run(
    words: list[str], folder: Path, out: int, before: Callable[[], object]
) -> None:
    """Be the command; this never returns."""
    code = UNCAUGHT
    try:
        os.setsid()
        os.chdir(folder)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w")  # noqa: SIM115
        size = int(
            re.findall(r"VmSize:\s+(\d+)", Path("/proc/self/status").read_text())[0]
        )
        resource.setrlimit(resource.RLIMIT_AS, (size * 1024 + BYTES,) * 2)
        resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, LARGEST))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        from tolstat.cli.entry import entry

        sys.argv = ["tolstat", *words]
        before()
        entry()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(code)


def words_of(counts: Counter[str]) -> str:
    """Return how many commands ended in each way, in words."""
    kinds = ", ".join(f"{kind} {count}" for kind, count in counts.most_common())
    return f"{counts.total()} commands: {kinds}"
