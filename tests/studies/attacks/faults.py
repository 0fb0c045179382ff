"""Calls that fail, one by one: what a command says, leaves and loses.

    python -m tests.studies.attacks.faults [COMMAND...] [CALL...] [MOST]

The first, second, third .. call of a kind on files of a folder fails, while a command
works there: at most MOST of each kind and error, evenly spread (default 8). Afterwards
the same command, without faults, has to come to the right bits. It needs a C compiler.
The exit code is 1 if anything is wrong.
"""

from __future__ import annotations

import ctypes
import errno
import mmap
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests import attacks
from tests.studies.attacks.commands import Outcome, ask, warm

SOURCE = Path(__file__).with_suffix(".c")
KINDS = "write", "sync", "rename", "open", "read", "truncate", "link", "unlink"
EIO, FULL, SHORT = errno.EIO, errno.ENOSPC, 0
ERRORS = {  # of a call: error, and whether all later calls have it, too
    "write": [(EIO, 0), (FULL, 0), (FULL, 1), (SHORT, 0)],
    "sync": [(EIO, 0), (FULL, 1)],
    "rename": [(EIO, 0), (FULL, 1)],
    "open": [(EIO, 0), (errno.EMFILE, 0), (EIO, 1)],
    "read": [(EIO, 0), (EIO, 1), (SHORT, 0)],
    "truncate": [(FULL, 0)],
    "link": [(errno.EPERM, 1)],
    "unlink": [(EIO, 0), (EIO, 1)],
}
MOST = 8
LEFT = "left until the next command"  # this is not wrong
OLD = b'<meta name="generator" content="tolstat">\nof an earlier answer'
MARKS = {".html": b"</html>", "batch.csv": b"\n"}  # how a whole answer ends


class Attack(NamedTuple):
    """A command whose calls fail."""

    command: str
    before: str  # the run before it, of `attacks.prepared`
    answers: tuple[str, ...] = ()  # files that it writes, beside runs
    replaced: tuple[str, ...] = ()  # those of them that are there before
    later: str = ""  # the command that finishes; the same if empty


ATTACKS = {
    "run": Attack("run a.toml", ""),
    "resume": Attack("resume a.h5", "part"),
    "extend": Attack("extend a.h5 --trials 6000", "whole"),
    "force": Attack("run a.toml --force", "old"),
    "report": Attack("report a.h5", "whole", ("a.html",), ("a.html",)),
    "batch": Attack(
        "batch a.toml b.toml", "part",
        ("a.html", "b.html", "batch.html", "batch.csv"), ("a.html",),
    ),
    "export": Attack("export a.h5 -o a.csv --force", "whole", ("a.csv",), ("a.csv",)),
    "what-if": Attack("what-if a.h5 A=+-0.08mm --write n.toml", "whole", ("n.toml",)),
    "verify": Attack("verify a.h5", "whole"),
    "check": Attack("check a.h5", "whole"),
    "runs": Attack("runs .", "whole"),
}  # fmt: skip


class Page(ctypes.Structure):
    """What the library reads and counts; as in faults.c."""

    _fields_ = [
        ("kind", ctypes.c_long), ("number", ctypes.c_long), ("onward", ctypes.c_long),
        ("error", ctypes.c_long), ("calls", ctypes.c_long * len(KINDS)),
        ("failed", ctypes.c_long), ("folder", ctypes.c_char * 4096),
    ]  # fmt: skip


class Faults:
    """The page that processes share, and the library that reads it."""

    def __init__(self) -> None:
        self.page = Page.from_buffer(mmap.mmap(-1, ctypes.sizeof(Page)))
        self._library = ctypes.CDLL(os.environ["LD_PRELOAD"])

    def ask(
        self, words: str, folder: Path, kind="", number=0, error=0, onward=0
    ) -> Outcome:
        """Carry out a command of which a call fails; 0 for none."""
        page = self.page
        page.kind, page.number = KINDS.index(kind) if kind else 0, number
        page.error, page.onward, page.failed = error, onward, 0
        page.calls[:] = [0] * len(KINDS)
        page.folder = os.fsencode(folder)
        arm = lambda: self._library.faults_arm(ctypes.byref(page))  # noqa: E731
        return ask(words, folder, before=arm, seconds=20.0)


class Setting(NamedTuple):
    """An attack, its folder before, and what the folder holds at its right end."""

    attack: Attack
    origin: Path
    files: set[str]
    runs: dict[str, object]
    answers: dict[str, bytes]


def setting(name: str, folder: Path, faults: Faults) -> tuple[Setting, Counter]:
    """Return an attack prepared, and how many calls of each kind it has."""
    attack, origin = ATTACKS[name], folder / f"{name}-before"

    def prepare() -> None:
        attacks.prepared(origin, attack.before)
        for other in ("rare.toml", "priced.toml"):
            (origin / other).unlink()
        for path in origin.glob("*.warm"):
            path.unlink()
        for answer in attack.replaced:
            (origin / answer).write_bytes(OLD)
            os.utime(origin / answer, (1, 1))  # older than its run
        os._exit(0)

    prepared = ask("", folder, before=prepare, seconds=60.0)
    assert prepared.code == 0, prepared.text
    copy = copied(origin, folder)
    ended = faults.ask(attack.command, copy)
    calls = Counter(dict(zip(KINDS, faults.page.calls, strict=True)))
    assert ended.kind == "worked", ended
    answers = {x: (copy / x).read_bytes() for x in attack.answers}
    files = {path.name for path in copy.iterdir()}
    return Setting(attack, origin, files, attacks.frames(copy), answers), calls


def copied(origin: Path, folder: Path) -> Path:
    copy = folder / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(origin, copy)
    return copy


def damaged_run(prepared: Setting, copy: Path) -> str:
    """Return what is wrong with the runs of a folder after a fault; empty if nothing."""
    before = {path.name for path in prepared.origin.glob("*.h5")}
    try:
        runs = attacks.frames(copy)
        attacks.known_rows(runs, prepared.runs)
    except Exception as error:
        return f"lost: {type(error).__name__}: {error}"[:200]
    if missing := before - {*runs}:
        return f"lost: {missing}"
    run = runs.get("a.h5")
    if prepared.attack.before == "old":
        old = attacks.frames(prepared.origin)["a.h5"]
        earlier = copy / "a.h5.before"
        same = run.sampled.seed == 4 and run.frame().equals(old.frame())
        if not same and not run.complete and not earlier.exists():
            return "lost: the run before"
    if prepared.attack.before == "part":
        ended = attacks.frames(prepared.origin)["a.h5"].ended
        if run.ended < ended:
            return f"lost: {ended - run.ended} trials"
    return ""


def is_whole(name: str, data: bytes, right: bytes) -> bool:
    """Tell whether an answer is the right one: dates and states in it may differ."""
    mark = MARKS.get(name, MARKS.get(Path(name).suffix))
    return data.endswith(mark) if mark else data == right


def damaged_answer(prepared: Setting, copy: Path) -> str:
    """Return which answer is neither the old nor a new one; empty if none is."""
    for name, right in prepared.answers.items():
        data = (copy / name).read_bytes() if (copy / name).exists() else b""
        if name in prepared.attack.replaced and not data:
            return f"lost: {name}"
        if data and data != OLD and not is_whole(name, data, right):
            return f"torn: {name}"
    return ""


def finished(prepared: Setting, copy: Path) -> str:
    """Carry out the command that finishes; return what is wrong with its end."""
    words, path = prepared.attack.command, copy / "a.h5"
    if words.startswith(("run a.toml", "extend")) and path.exists():
        run = attacks.frames(copy)["a.h5"]
        new = run.sampled.seed == 3 and run.trials == prepared.runs["a.h5"].trials
        if new:
            words = "resume a.h5"
    for name in {*prepared.answers} - {*prepared.attack.replaced}:
        (copy / name).unlink(missing_ok=True)  # what-if replaces no study
    ended = ask(words, copy, seconds=20.0)
    if ended.kind != "worked":
        return f"not finished: {words}: {ended.kind}: {ended.last_line}"
    runs = attacks.frames(copy)
    for name, right in prepared.runs.items():
        run = runs[name]
        if not run.complete or not run.frame().equals(right.frame()):
            return f"other bits: {name}"
        if repr(run.diagnostics) != repr(right.diagnostics):
            return f"other diagnostics: {name}"
    for name, right in prepared.answers.items():
        if not is_whole(name, (copy / name).read_bytes(), right):
            return f"other answer: {name}"
    if more := {path.name for path in copy.iterdir()} - prepared.files:
        return f"left for good: {', '.join(sorted(more))}"
    return ""


def problems(prepared: Setting, copy: Path, ended: Outcome):
    """Yield what is wrong after a fault."""
    if ended.kind not in ("worked", "sentence"):
        yield ended.kind
    if "damaged" in ended.text:
        yield "blames damage"
    if wrong := damaged_run(prepared, copy) or damaged_answer(prepared, copy):
        yield wrong
        if wrong.startswith("lost"):
            return
    elif ended.code == 0:
        runs = attacks.frames(copy)
        done = all(
            name in runs
            and runs[name].complete
            and runs[name].frame().equals(right.frame())
            for name, right in prepared.runs.items()
        )
        if not done or any((copy / x).read_bytes() == OLD for x in prepared.answers):
            yield "exit 0, but it is not done"
    allowed = prepared.files | {"a.h5.before"}
    if more := {path.name for path in copy.iterdir()} - allowed:
        kinds = sorted({"." + name.rpartition(".")[2] for name in more})
        yield f"{LEFT}: {', '.join(kinds)}"
    if wrong := finished(prepared, copy):
        yield wrong


def spread(calls: int, most: int) -> list[int]:
    return sorted({*np.linspace(1, calls, min(calls, most)).astype(int).tolist()})


def planned(calls: dict[str, int], most: int):
    """Yield the faults of a command: its call, number, error, whether it lasts."""
    for kind, number_of_calls in calls.items():
        for error, onward in ERRORS[kind] if number_of_calls else ():
            for number in spread(number_of_calls, most):
                yield kind, number, error, onward


def again_preloaded(words: list[str], compiler: str) -> int:
    """Compile the library, and start again with it; return the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "faults.so")
        flags = "-O1", "-fPIC", "-shared"
        subprocess.run([compiler, *flags, "-o", library, SOURCE, "-ldl"], check=True)
        command = [sys.executable, "-m", "tests.studies.attacks.faults", *words]
        environment = {**os.environ, "LD_PRELOAD": str(library)}
        return subprocess.run(command, env=environment, check=False).returncode


def main(words: list[str]) -> int:
    compiler = shutil.which("cc")
    if not compiler:
        print("there is no C compiler: no faults are injected")
        return 0
    if "LD_PRELOAD" not in os.environ:
        return again_preloaded(words, compiler)
    most = int(words.pop()) if words and words[-1].isdigit() else MOST
    kinds = [word for word in words if word in KINDS] or KINDS
    faults, ends, wrong = Faults(), defaultdict(Counter), defaultdict(Counter)
    warm()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(os.path.realpath(name))
        for what in [word for word in words if word in ATTACKS] or ATTACKS:
            prepared, calls = setting(what, folder, faults)
            print(f"{what}: {listed(calls)}", flush=True)
            chosen = {kind: calls[kind] for kind in kinds}
            for kind, number, error, onward in planned(chosen, most):
                copy = copied(prepared.origin, folder)
                command = prepared.attack.command
                ended = faults.ask(command, copy, kind, number, error, onward)
                ends[what, kind][ended.kind] += 1
                how = errno.errorcode.get(error, "short") + "..." * onward
                for problem in problems(prepared, copy, ended):
                    wrong[what, kind][problem.partition(":")[0]] += 1
                    line = f"{what} | {kind} {number} {how} | {problem}"
                    print(f"{line} | {ended.last_line}", flush=True)
    print("\ncommand, call | ends | wrong")
    for key, counts in ends.items():
        print(f"{', '.join(key)} | {listed(counts)} | {listed(wrong[key])}")
    ended, mistakes = sum(ends.values(), Counter()), sum(wrong.values(), Counter())
    left = mistakes.pop(LEFT, 0)
    print(f"\n{ended.total()} faults: {listed(ended)}; {LEFT} {left}")
    print(f"wrong: {listed(mistakes)}")
    return 1 if mistakes else 0


def listed(counts: Counter) -> str:
    return (
        ", ".join(f"{name} {count}" for name, count in counts.most_common()) or "none"
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
