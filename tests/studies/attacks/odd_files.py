"""Pipes, devices, folders and links in the place of each file: how a command ends.

    python -m tests.studies.attacks.odd_files [PLACE...]

A place is any part of a name in `PLACES`, or `modes`: those of files that are replaced,
or `temporary`: names that somebody has taken; default: all. Nothing may end in a
traceback, by a signal, after ten seconds or with 1.5 GB, and what a link leads to stays.
The exit code is 1 if anything is wrong.
"""

from __future__ import annotations

import os
import shutil
import socket
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests import attacks
from tests.studies.attacks.commands import Outcome, ask, warm

PARTS = "length\n" + "10.01\n9.99\n10.02\n9.98\n10.0\n" * 40
MEASURED = attacks.STUDY.replace(
    'nominal = "10 mm", tolerance = "+-0.1 mm"',
    'nominal = "10 mm", data = "parts.csv", column = "length", unit = "mm"',
)
LARGE = 3_000_000_000  # bytes of a file without data
VICTIM = "what a link leads to\n"
READS_RUN = (
    "show a.h5", "show a.h5 --follow", "check a.h5", "verify a.h5", "report a.h5",
    "export a.h5 -o t.csv", "compare b.h5 a.h5", "what-if a.h5 A=+-0.05mm", "trial a.h5 3",
    "resume a.h5", "extend a.h5 --trials 4000", "run a.toml --force", "batch a.toml", "runs .",
)  # fmt: skip
WRITES_RUN = (
    "run c.toml",
    "run a.toml --force",
    "resume p.h5",
    "extend a.h5 --trials 4000",
)
ANSWERS = "report a.h5 -o a.html", "export a.h5 -o a.csv --force"
# by the name of what is odd, the commands that read it, write it or look at it
PLACES = {
    "a.toml": (
        "run a.toml --force", "batch a.toml b.toml", "allocate a.toml", "doctor a.toml",
        "trial a.toml --nominal", "show a.toml", "show a.h5", "report a.h5 -o a.html",
        "resume a.h5", "extend a.h5 --trials 4000", "what-if a.h5 A=+-0.05mm", "verify a.h5",
    ),
    "other.toml": ANSWERS,
    "../other.toml": ANSWERS,
    "parts.csv": ("run measured.toml", "batch measured.toml", "doctor measured.toml"),
    "a.h5": READS_RUN,
    "x.h5": ("runs .", "show x.h5"),
    "folder": ("runs folder", "batch a.toml -o folder", "run a.toml -o folder/a.h5"),
    "c.h5": ("run c.toml", "run c.toml --force", "batch c.toml"),
    "a.h5.before": ("run a.toml --force", "extend a.h5 --trials 4000", "show a.h5"),
    "p.h5.before": ("resume p.h5", "run p.toml --force", "show p.h5"),
    "a.h5.lock": ("extend a.h5 --trials 4000", "run a.toml --force", "show a.h5 --follow"),
    "p.h5.lock": ("resume p.h5", "show p.h5 --follow", "batch p.toml"),
    "c.h5.lock": ("run c.toml",),
    "a.html": ("report a.h5", "batch a.toml", "compare a.h5 b.h5 -o a.html"),
    "a.csv": ("export a.h5 -o a.csv", "export a.h5 -o a.csv --force", "report a.h5 --csv -o a.csv"),
    "batch.html": ("batch a.toml b.toml", "batch c.toml"),
    "batch.csv": ("batch a.toml b.toml",),
    "n.toml": ("what-if a.h5 A=+-0.05mm --write n.toml", "new dimension_chain -o n.toml", "allocate priced.toml -o n.toml --force"),
    "a.png": ("show a.h5 --plot a.png", "allocate priced.toml --plot a.png"),
    "own.py": ("run a.toml --force --machine own.py:Own", "models --machine own.py:Own", "new --model own.py", "doctor own.py:Own"),
}  # fmt: skip


def listening(path: Path) -> None:
    """Leave a socket of a name."""
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(os.path.relpath(path))


def sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(LARGE)


ODD = {
    "a pipe": os.mkfifo,
    "a folder": Path.mkdir,
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "a link to /dev/full": lambda path: path.symlink_to("/dev/full"),
    "a link to nothing": lambda path: path.symlink_to("nothing"),
    "a link to itself": lambda path: path.symlink_to(path.name),
    "a link to a victim": lambda path: path.symlink_to("victim"),
    "3 GB of holes": sparse,
    "an empty file": Path.touch,
    "a socket": listening,
}
FOLLOWED = ".html", "a.csv", "batch.csv", "n.toml", ".png"  # answers
REPLACED = {  # by command, the file that has mode 600 before and after
    "extend a.h5 --trials 4000": "a.h5",
    "run a.toml --force": "a.h5",
    "resume p.h5": "p.h5",
    "report a.h5 -o a.html": "a.html",
    "export a.h5 -o a.csv --force": "a.csv",
    "batch a.toml": "batch.html",
}


def prepare(origin: Path) -> None:
    """Make the folder of all these files, each as it should be."""
    attacks.prepared(origin, "whole")
    attacks.prepared(origin / "part", "part")
    shutil.move(origin / "part/a.h5", origin / "p.h5")
    shutil.rmtree(origin / "part")
    shutil.copy(origin / "a.h5", origin / "b.h5")
    for name in "cp":
        (origin / f"{name}.toml").write_text(attacks.STUDY)
    (origin / "measured.toml").write_text(MEASURED)
    (origin / "parts.csv").write_text(PARTS)
    (origin / "rare.toml").unlink()
    for answer in ("a.html", "a.csv"):
        (origin / answer).write_text("an earlier answer\n")
    (origin / "victim").write_text(VICTIM)


def copied(origin: Path, folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    copy = folder / "copy"
    shutil.copytree(origin, copy)
    return copy


def wrong_of(ended: Outcome, copy: Path, follows: bool = False) -> str:
    """Return what is wrong after a command; empty if nothing is.

    An answer follows a link of its name: that is as it should be.
    """
    victim = copy / "victim"
    whole = victim.exists() and (follows or victim.read_bytes() == VICTIM.encode())
    if not whole:
        return "victim overwritten"
    return "" if ended.kind in ("worked", "sentence") else ended.kind


def odd(origin: Path, folder: Path, chosen: list[str]):
    """Yield what stood where, the command, how it ended, and what is wrong."""
    for name in chosen:
        for what, make in ODD.items():
            for command in PLACES[name]:
                copy = copied(origin, folder)
                path = copy / name
                path.unlink(missing_ok=True)
                before = os.getcwd()
                os.chdir(path.parent)  # the name of a socket is short
                make(path)
                os.chdir(before)
                ended = ask(command, copy)
                follows = name.endswith(FOLLOWED)
                yield f"{name}: {what}", command, ended, wrong_of(ended, copy, follows)


def modes(origin: Path, folder: Path):
    """Yield commands that replace a file of mode 600, and what is wrong."""
    for command, name in REPLACED.items():
        copy = copied(origin, folder)
        if name == "batch.html":
            (copy / name).write_text("<title>tolstat batch")
        (copy / name).chmod(0o600)
        ended = ask(command, copy)
        mode = (copy / name).stat().st_mode & 0o777
        wrong = wrong_of(ended, copy) or ("" if mode == 0o600 else f"mode {mode:o}")
        yield f"{name}: mode 600", command, ended, wrong


def taken_names(origin: Path, folder: Path):
    """Yield commands whose temporary names are links to a victim, and what is wrong."""
    for command, name in REPLACED.items():
        copy = copied(origin, folder)

        def take(name=name) -> None:
            for number in range(100):
                os.symlink("victim", f"{name}.{os.getpid()}-{number}.part")

        ended = ask(command, copy, before=take)
        yield (
            f"{name}: its temporary name a link",
            command,
            ended,
            wrong_of(ended, copy),
        )


def main(words: list[str]) -> int:
    chosen = [
        name for name in PLACES if not words or any(word in name for word in words)
    ]
    warm()
    counts, wrong = Counter(), Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(os.path.realpath(name))
        origin, work = folder / "origin", folder / "work"
        prepared = ask(
            "", folder, before=lambda: (prepare(origin), os._exit(0)), seconds=60.0
        )
        assert prepared.code == 0, prepared.text
        attempts = [odd(origin, work, chosen)]
        for word, more in {"modes": modes, "temporary": taken_names}.items():
            attempts += [more(origin, work)] if word in (words or [word]) else []
        for attempt in attempts:
            for where, command, ended, problem in attempt:
                counts[ended.kind] += 1
                if problem:
                    wrong[problem] += 1
                    print(
                        f"{problem} | {where} | {command} | {ended.last_line}",
                        flush=True,
                    )
    listed = lambda c: ", ".join(f"{k} {n}" for k, n in c.most_common()) or "none"  # noqa: E731
    print(
        f"\n{sum(counts.values())} commands: {listed(counts)}; wrong: {listed(wrong)}"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
