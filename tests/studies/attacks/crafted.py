"""Crafted run files times the commands that open a run: how each ends.

    python -m tests.studies.attacks.crafted [CHANGE...]

A change is any part of a name in `crafted_files.CHANGES`; it meets all commands. Without
a name all changes meet ten commands each. Nothing may end in a traceback, by a signal,
after ten seconds or with 1.5 GB, and no answer may hold a byte of another file. The exit
code is 1 if one does.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from tests.studies.attacks.commands import STUDY, ask, warm, words_of
from tests.studies.attacks.crafted_files import CHANGES, SECRET, craft, secrets

COMMANDS = [  # for each change
    "show r.h5", "verify r.h5", "report r.h5", "export r.h5 -o r.csv", "trial r.h5 3",
    "what-if r.h5 A=+-0.05mm", "resume r.h5", "extend r.h5 --trials 300",
]  # fmt: skip
IN_TURN = [  # two for each change, in turn
    "check r.h5", "show r.h5 --follow", "compare good.h5 r.h5", "batch r.toml", "runs .",
    "run r.toml --force", "report r.h5 --json", "check r.h5 --json",
    "what-if r.h5 A=+-0.05mm --write n.toml",
]  # fmt: skip
RIGHT = "worked", "sentence"


def crafted_run(good: Path, folder: Path, change: str) -> bool:
    """Craft a run in a process of its own; False if HDF5 refuses to write it."""
    path = folder / "r.h5"
    ended = ask("", folder, before=lambda: (craft(good, path, change), os._exit(0)))
    if ended.code and not path.exists():
        print(ended.text[-500:])
    return path.exists()


def leaks(folder: Path, text: str, before: dict[str, str]) -> str:
    """Return which answer holds a byte of another file; empty if none does."""
    if (folder / "CODE RAN").exists():
        return "code ran"
    outputs = {"the screen": text.encode()}
    for path in folder.iterdir():
        if (
            path.is_file()
            and not path.is_symlink()
            and digest(path) != before.get(path.name)
        ):
            outputs[path.name] = path.read_bytes()
    return next((n for n, out in outputs.items() if any(s in out for s in SECRET)), "")


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def attacked(folder: Path, chosen: list[str]):
    """Yield each change and command with a word for how it ended, and its last line."""
    good = folder / "good.h5"
    (folder / "good.toml").write_text(STUDY)
    assert ask("run good.toml", folder).code == 0
    for number, change in enumerate(chosen):
        origin, copy = folder / "origin", folder / "copy"
        shutil.rmtree(origin, ignore_errors=True)
        origin.mkdir()
        (origin / "r.toml").write_text(STUDY)
        shutil.copy(good, origin)
        secrets(origin)
        if not crafted_run(good, origin, change):
            yield change, "-", "not crafted", ""
            continue
        (origin / "r.tmp").unlink(missing_ok=True)
        before = {
            p.name: digest(p)
            for p in origin.iterdir()
            if p.is_file() and not p.is_symlink()
        }
        if len(chosen) == len(CHANGES):
            others = [IN_TURN[(2 * number + i) % len(IN_TURN)] for i in (0, 1)]
        else:
            others = IN_TURN
        for command in [*COMMANDS, *others]:
            shutil.rmtree(copy, ignore_errors=True)
            copy.mkdir()
            for path in origin.iterdir():
                if path.is_fifo():
                    os.mkfifo(copy / path.name)
                else:
                    shutil.copy2(path, copy, follow_symlinks=False)
            ended = ask(command, copy)
            kind = ended.kind
            if kind in RIGHT and (where := leaks(copy, ended.text, before)):
                kind = f"leak in {where}"
            yield change, command, kind, ended.last_line


def main(words: list[str]) -> int:
    chosen = [
        name for name in CHANGES if not words or any(word in name for word in words)
    ]
    warm()
    counts, wrong = Counter(), defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(os.path.realpath(name))
        for change, command, kind, line in attacked(folder, chosen):
            counts[kind] += 1
            if kind not in (*RIGHT, "not crafted"):
                wrong[kind, change, line if kind == "traceback" else ""].append(command)
                if len(wrong[kind, change, line if kind == "traceback" else ""]) == 1:
                    print(f"{kind} | {change} | {command} | {line}", flush=True)
    print("\nend | change | commands | last line")
    for (kind, change, line), commands in sorted(wrong.items()):
        print(f"{kind} | {change} | {len(commands)}: {', '.join(commands)} | {line}")
    print(f"\n{len(chosen)} changes, {words_of(counts)}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
