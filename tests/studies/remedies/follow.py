"""Follows what tolstat prints, to the end, and evaluates where that leads.

A study is run from the command line. Of what its summary prints, the first commands
are typed as they stand, and so on with the new run, until nothing is printed that
changes the study or adds trials.

    python -m tests.studies.remedies.follow [NAME ...]
"""

from __future__ import annotations

import os
import re
import shlex
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import tomli_w
from click.testing import CliRunner

import tolstat
from tests.studies.remedies import machines
from tests.studies.remedies.chains import CHAINS, UNSOLVABLE
from tolstat.cli.main import main

MOST_ROUNDS = 6
MOST_TRIALS = 200_000  # that a printed command may add
TRUTH = 400_000  # trials that tell where it leads


class Outcome(NamedTuple):
    """Where the printed commands lead."""

    before: float  # out of any limit, ppm
    after: float
    met: bool  # all limits, in truth
    worse: bool  # a limit that was met in truth is missed
    printed: str  # verdicts of the last run
    commands: int


def follow(study, machine=None):
    """Follow what is printed of a study, in this folder."""
    Path("design.toml").write_text(tomli_w.dumps(study))
    place = f"{machines.__file__}:{machine}"
    option = ["--machine", place] if machine else []
    printed = _typed(shlex.join(["tolstat", "run", "design.toml", *option]))
    path, number = "design.h5", 1
    for _ in range(MOST_ROUNDS):
        commands = [
            line
            for line in re.findall(r"^ *(tolstat .*)$", printed, re.MULTILINE)
            if shlex.split(line)[1] in ("what-if", "run", "extend", "decide")
        ]
        first = shlex.split(commands[0]) if commands else []
        if not first:
            break
        if first[1] == "what-if":
            _typed(commands[0])
            first, commands = shlex.split(commands[1]), commands[1:]
            path = Path(first[2]).with_suffix(".h5").name
        elif (
            "--trials" in first
            and int(first[first.index("--trials") + 1]) > MOST_TRIALS
        ):
            break
        printed = _typed(commands[0])
        number += 1
    run = tolstat.open(path)
    shares = [_truth(table, machine) for table in (study, run.study.table)]
    (before, each_before), (after, each_after) = shares
    worse = any(
        x > p >= y for (x, p), (y, _) in zip(each_after, each_before, strict=True)
    )
    met = all(x <= p for x, p in each_after)
    verdicts = ", ".join(sorted({*tolstat.summary(run).verdicts.values()}))
    return Outcome(1e6 * before, 1e6 * after, met, worse, verdicts, number)


def _typed(command):
    done = CliRunner(env={"COLUMNS": "200"}).invoke(main, shlex.split(command)[1:])
    if done.exit_code not in (0, 3, 4):
        raise SystemExit(f"{command}\n{done.output}")
    return re.sub(r" \\\n +", " ", done.output)


def _truth(table, machine):
    """Return fractions out of any limit, and of each limit with what is permitted."""
    model = machines.DESIGNS[machine] if machine else None
    keys = {"trials": TRUTH, "seed": 99, "sampling": "random"}
    run = tolstat.run(dict(table) | keys, model=model)
    out = {name: run.beyond(name) for name in run.limits}
    any_limit = sum(out.values()) > 0
    each = [(x.mean(), 1 - run.limits[name].demanded) for name, x in out.items()]
    return float(any_limit.mean()), each


def problems():
    """Yield name, study and machine of all problems, and whether they can be solved."""
    for name, design in machines.DESIGNS.items():
        yield design.title, design.study, name, design.problem.solvable
    for name, study in CHAINS.items():
        yield name, study, None, name not in UNSOLVABLE


if __name__ == "__main__":
    chosen, started, solved = sys.argv[1:], time.time(), [0, 0]
    for title, table, own, solvable in problems():
        if chosen and title not in chosen:
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            found = follow(table, own)
            os.chdir("/")
        solved[0] += solvable and found.met
        solved[1] += solvable
        print(
            f"| {title}{'' if solvable else ' (impossible)'} | {found.before:.0f} | "
            f"{found.after:.0f} | {'yes' if found.met else 'no'} | "
            f"{'yes' if found.worse else 'no'} | {found.printed} | {found.commands} |",
            flush=True,
        )
    print(f"met {solved[0]} of {solved[1]} solvable; {time.time() - started:.0f} s")
