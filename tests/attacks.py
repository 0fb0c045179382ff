"""Attacks on runs, in number: what is lost, silent or a traceback is printed.

    python -m tests.attacks kills            300 SIGKILLs at random moments
    python -m tests.attacks flips            500 changed bits, holes and cuts
    python -m tests.attacks models           100 models that break the contract
    python -m tests.attacks executors        50 faults of executors and clusters

A number after the name makes it as many. The exit code is 1 if one gets through.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np

import tolstat
from tests.conftest import TOY_STUDY, Toy
from tests.execution.rare_chain import CHAIN as RARE
from tests.store.tampering import everything
from tolstat.errors import TolstatError
from tolstat.store import run_writer

STUDY = """\
model = "dimension_chain"
trials = 3000
seed = 3
settings.gap = "A - B"
links.A = { nominal = "10 mm", tolerance = "+-0.1 mm" }
links.B = { nominal = "9 mm", tolerance = "+-0.1 mm" }
limits.gap = ">= 0.8 mm"
"""
COST = """{ law = "reciprocal", at = "+-0.1 mm", price = 10, tightest = "+-0.02 mm", \
loosest = "+-0.2 mm" }"""
PRICED = STUDY.replace('">= 0.8 mm"', '{ limit = ">= 0.9 mm", yield = "80 %" }')
PRICED = PRICED.replace('"+-0.1 mm" }', f'"+-0.1 mm", cost = {COST} }}')
NUMBERS = {"kills": 300, "flips": 500, "models": 100, "executors": 50}
LOADED = [  # once, and not by each process that is killed
    "tests.attacks", "scipy.optimize", "tolstat.cli.batch", "tolstat.cli.allocate",
    "tolstat.answers.rare.rare_answer", "tolstat.answers.reports",
    "tolstat.execution.execute", "tolstat.machines.dimension_chain.machine",
]  # fmt: skip
SLOW = 10.0  # s, to notice that an executor fails
BLOCK = 64  # trials: many commits
KINDS = "bit", "bit", "bit", "hole", "cut", "more"  # of flips


def command(*words):
    from click.testing import CliRunner

    from tolstat.cli.main import main

    done = CliRunner().invoke(main, [*map(str, words)])
    assert done.exit_code in (0, 3, 4), done.output
    return done.output


# by the name of what is killed: whether a run lies there, and what is done
DONE = {
    "run": ("", lambda: tolstat.run("a.toml")),
    "resume": ("part", lambda: tolstat.resume("a.h5")),
    "extend": ("whole", lambda: tolstat.extend("a.h5", trials=6000)),
    "force": ("old", lambda: tolstat.run("a.toml", force=True)),
    "batch": ("", lambda: command("batch", "a.toml", "b.toml")),
    "rare": ("", lambda: tolstat.run("rare.toml")),
    "allocate": ("", lambda: command("allocate", "priced.toml", "-o", "out.toml")),
}


def act(what, folder):
    """Do one of these in a process that will be killed; each block is a commit."""
    os.chdir(folder)
    run_writer.SAFE_EVERY = 0.0
    from tolstat.execution.workers import block_scheduler

    block_scheduler.FIRST_BLOCK, block_scheduler.GROWTH = BLOCK, 1
    from tolstat.answers.report.full_report import Report

    Report.html = lambda self: "a page"  # takes longer than all else
    devnull = open(os.devnull, "w")  # noqa: SIM115
    sys.stdout = sys.stderr = devnull
    DONE[what][1]()


def frames(folder):
    """Return the rows of each run of a folder."""
    return {path.name: tolstat.open(path) for path in sorted(folder.glob("*.h5"))}


def prepared(folder, there):
    folder.mkdir()
    (folder / "a.toml").write_text(STUDY)
    (folder / "b.toml").write_text(STUDY.replace("seed = 3", "seed = 4"))
    (folder / "rare.toml").write_text(RARE)
    (folder / "priced.toml").write_text(PRICED)
    path = folder / "a.h5"
    with contextlib.chdir(folder):
        if there == "whole":
            tolstat.run("a.toml")
        elif there == "old":
            tolstat.run("b.toml", output=path)
        elif there == "part":
            from tolstat.execution.execute import execute
            from tolstat.execution.workers.block_scheduler import Workers
            from tolstat.study.study import load

            looks = []
            stop = lambda: len(looks) > 20 or looks.append(0)  # noqa: E731
            with Workers(1, stop, block=50) as crew:
                execute(load("a.toml"), path, crew)


def finished(folder, what):
    """Go on where it was killed, as a user would: the same command, or resume."""
    with contextlib.chdir(folder):
        path = Path("rare.h5" if what == "rare" else "a.h5")
        if what in ("batch", "allocate"):
            Path("out.toml").unlink(missing_ok=True)
            DONE[what][1]()
        elif path.exists() and not tolstat.open(path).complete:
            tolstat.resume(path)
            if what == "extend" and tolstat.open(path).trials < 6000:
                DONE[what][1]()
        elif (
            not path.exists()
            or (what == "extend" and tolstat.open(path).trials < 6000)
            or (what == "force" and tolstat.open(path).sampled.seed == 4)
        ):
            DONE[what][1]()


def known_rows(before, after):
    """Check that what is stored is of the run to come, bit by bit."""
    for name, run in before.items():
        of = after.get(name)
        if of is None or run.sampled.seed != of.sampled.seed:
            continue
        n = min(run.trials, of.trials)
        ran = run.status[:n] != 0
        for column in (*run.units, "status"):
            one, two = run.column(column)[:n][ran], of.column(column)[:n][ran]
            np.testing.assert_array_equal(one, two)


def kills(number, folder):
    """Yield what was killed, and what is wrong."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(LOADED)
    dice, whole, origin, seconds = random.Random(5), {}, {}, {}
    for what, (there, _) in DONE.items():
        origin[what] = folder / f"{what}-before"
        prepared(origin[what], there)
        known = folder / f"{what}-known"
        shutil.copytree(origin[what], known)
        for _ in range(2):  # the second time nothing is compiled
            shutil.rmtree(known)
            shutil.copytree(origin[what], known)
            process = context.Process(target=act, args=(what, known))
            began = time.monotonic()
            process.start()
            process.join()
            assert process.exitcode == 0, what
            seconds[what] = time.monotonic() - began
        whole[what] = frames(known)
    counted = 0
    while counted < number:
        what = [*DONE][counted % len(DONE)]
        place = folder / "killed"
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(origin[what], place)
        process = context.Process(target=act, args=(what, place))
        process.start()
        process.join(dice.uniform(0.0, seconds[what]))
        if not process.is_alive():
            continue
        process.kill()
        process.join()
        counted += 1
        try:
            known_rows(frames(place), whole[what])
            finished(place, what)
            after = frames(place)
            assert {*after} == {*whole[what]}, [*after]
            for name, run in after.items():
                assert run.complete
                assert run.frame().equals(whole[what][name].frame()), name
                assert repr(run.diagnostics) == repr(whole[what][name].diagnostics)
            yield what, ""
        except Exception:
            yield what, traceback.format_exc(limit=-3)


def flips(number, folder):
    """Yield how a stored run was changed, and what is wrong."""
    path = folder / "toy.h5"
    (folder / "toy.toml").write_text(TOY_STUDY)
    run = tolstat.run(folder / "toy.toml", model=Toy())
    data, known, dice = path.read_bytes(), everything(run), random.Random(11)
    for i in range(number):
        changed, how = bytearray(data), KINDS[i % len(KINDS)]
        place = dice.randrange(len(data))
        if how == "bit":
            changed[place] ^= 1 << dice.randrange(8)
        elif how == "hole":
            changed[place : place + 512] = bytes(len(changed[place : place + 512]))
        elif how == "cut":
            del changed[place:]
        else:
            changed += dice.randbytes(100)
        path.write_bytes(changed)
        try:
            same = everything(tolstat.open(path)) == known
            yield how, "" if same else f"{how} at {place}: another run, silently"
        except TolstatError as error:
            yield how, "" if str(path) in str(error) else f"no file: {error}"
        except Exception:
            yield how, traceback.format_exc(limit=-3)


ANSWERS = {
    "none": lambda found, d: None,
    "numbers": lambda found, d: found.responses,
    "too few rows": lambda found, d: found._replace(responses=found.responses[:-1]),
    "too many rows": lambda found, d: found._replace(
        responses=np.concatenate([found.responses] * 2)
    ),
    "a column less": lambda found, d: found._replace(responses=found.responses[:, 1:]),
    "one dimension": lambda found, d: found._replace(responses=found.responses[:, 0]),
    "words": lambda found, d: found._replace(responses=found.responses.astype(str)),
    "objects": lambda found, d: found._replace(
        responses=found.responses.astype(object)
    ),
    "complex": lambda found, d: found._replace(responses=found.responses * 1j),
    "nan": lambda found, d: found._replace(responses=found.responses * np.nan),
    "infinite": lambda found, d: found._replace(responses=found.responses + np.inf),
    "huge": lambda found, d: found._replace(responses=found.responses * 0 + 1e308),
    "status 99": lambda found, d: found._replace(status=np.full(len(d), 99)),
    "status -1": lambda found, d: found._replace(status=np.full(len(d), -1)),
    "status of floats": lambda found, d: found._replace(status=np.full(len(d), 1.5)),
    "status of texts": lambda found, d: found._replace(status=np.full(len(d), "x")),
    "length of the block": lambda found, d: found._replace(
        responses=found.responses + 1e-5 * len(d)
    ),
    "mean of the block": lambda found, d: found._replace(
        responses=found.responses + d.mean()
    ),
    "changes its input": lambda found, d: (d.__setitem__(slice(None), 1.0), found)[1],
    "raises": lambda found, d: 1 / 0,
    "exits": lambda found, d: sys.exit(0),
    "recursion": lambda found, d: ANSWERS["recursion"](found, d),
    "memory": lambda found, d: np.zeros(10**15),
    "closes stdout": lambda found, d: (sys.stdout.close(), found)[1],
    "random": lambda found, d: found._replace(
        responses=found.responses + np.random.default_rng().random()
    ),
}
WHERE = ("every block", "trials at +", "long blocks", "a later block")


def models(number, folder):
    """Yield how a model lies, and what is wrong with the answer to that."""
    study = folder / "toy.toml"
    study.write_text(TOY_STUDY)
    plain = tolstat.run(study, model=Toy(), output=folder / "plain.h5")
    for i in range(number):
        how, where = [*ANSWERS][i % len(ANSWERS)], WHERE[i // len(ANSWERS) % len(WHERE)]

        class Lying(Toy):
            calls = 0

            def evaluate(self, d, settings, how=how, where=where):
                found = super().evaluate(d.copy(), settings)
                type(self).calls += 1
                lies = {
                    "every block": True,
                    "trials at +": d[0, 0] > 0,
                    "long blocks": len(d) > 40,
                    "a later block": self.calls > 5,
                }[where]
                return ANSWERS[how](found, d) if lies else found

        out, text = sys.stdout, open(os.devnull, "w")  # noqa: SIM115
        try:
            with contextlib.redirect_stdout(text):
                run = tolstat.run(
                    study, model=Lying(), output=folder / "lie.h5", force=True
                )
            found = tolstat.verify(run.path, model=Toy(), every=True)
            honest = run.frame().equals(plain.frame())
            failed = run.counts["done"] < plain.counts["done"]
            told = honest or failed or not found.whole
            yield how, "" if told else f"{how}, {where}: stored, silently"
        except TolstatError:
            yield how, ""
        except BaseException:
            yield how, f"{how}, {where}: {traceback.format_exc(limit=-3)}"
        finally:
            sys.stdout = out


REPLIES = {
    "cancelled": lambda f: f.cancel(),
    "nothing": lambda f: f.set_result(None),
    "a text": lambda f: f.set_result("answers"),
    "a pair of texts": lambda f: f.set_result(("a", "b")),
    "an error": lambda f: f.set_exception(OSError("the network is gone")),
    "an exit": lambda f: f.set_exception(SystemExit(0)),
    "a broken pool": lambda f: f.set_exception(BrokenPipeError()),
    "bytes": lambda f: f.set_result(b"\0" * 100),
}
ADDRESSES = (
    "x", "tcp://", "tcp://127.0.0.1", "tcp://127.0.0.1:1", "tls://h:1", "ucx://h:1",
    "inproc://1", "/etc/passwd", "tcp://[::1]:1", "tcp://127.0.0.1:99999",
)  # fmt: skip


def executors(number, folder):
    """Yield what an executor or a cluster does, and what is wrong."""
    study, path = folder / "a.toml", folder / "a.h5"
    study.write_text(STUDY.replace("3000", "200"))
    tolstat.run(study)  # from now on nothing is compiled
    for i in range(number):
        how, after = [*REPLIES, "address"][i % (len(REPLIES) + 1)], i // 9 % 3

        class Faulty(Executor):
            calls = 0

            def submit(self, fn, /, *args, how=how, after=after, **kwargs):
                self.calls += 1
                future = Future()
                if self.calls > 4 * after:
                    REPLIES[how](future)
                else:
                    future.set_result(fn(*args, **kwargs))
                return future

        path.unlink(missing_ok=True)
        began = time.monotonic()
        try:
            if how == "address":
                address = ADDRESSES[i // 9 % len(ADDRESSES)]
                from click.testing import CliRunner

                from tolstat.cli.main import main

                done = CliRunner().invoke(
                    main, ["run", str(study), "--cluster", address]
                )
                told = done.exit_code in (1, 2) and "Traceback" not in done.output
                yield how, "" if told else f"{address}: {done.output[-300:]}"
                continue
            tolstat.run(study, executor=Faulty())
            yield how, f"{how} after {after}: not noticed"
        except TolstatError:
            seconds = time.monotonic() - began
            whole = not path.exists() or tolstat.resume(path).complete
            wrong = "" if whole and seconds < SLOW else f"not resumed, or {seconds} s"
            yield how, wrong
        except BaseException:
            yield how, f"{how} after {after}: {traceback.format_exc(limit=-3)}"


def main(words):
    what = words[0] if words else ""
    if what not in NUMBERS:
        print(__doc__)
        return 2
    number = int(words[1]) if words[1:] else NUMBERS[what]
    counts, wrong = Counter(), 0
    with tempfile.TemporaryDirectory() as name:
        for how, said in globals()[what](number, Path(name)):
            counts[how] += 1
            wrong += bool(said)
            if sum(counts.values()) % 10 == 0:
                print(f"{sum(counts.values())}: {wrong} got through", flush=True)
            if said:
                print(f"{sum(counts.values())} {how}: {said}", flush=True)
    counted = ", ".join(f"{how} {count}" for how, count in counts.items())
    print(f"{what}: {sum(counts.values())} ({counted}); {wrong} got through")
    return 1 if wrong else 0


if __name__ == "__main__":
    from tests import attacks

    sys.exit(attacks.main(sys.argv[1:]))
