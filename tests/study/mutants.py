"""Studies with a mistake: each is a study of runs/ in which a hostile hand changed one.

    python -m tests.study.mutants            2 500 of them read, 500 through the command
                                             line with 5 s and 1 GB each

Every one is either a study, or refused by a message that names its file and a key.
"""

from __future__ import annotations

import copy
import datetime
import os
import random
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from tolstat import catalogue
from tolstat.errors import StudyError, TolstatError
from tolstat.study.study import load
from tolstat.study.study_schema import Document

ROOT = Path(__file__).parents[2]
OWN = {"stack": "stack.py:Stack", "oscillator": "oscillator.py:Oscillator"}
READ, RUN = 2500, 500
SECONDS, MEMORY = 5, 10**9  # of a process
COMMAND = "from tolstat.cli.entry import entry; entry()"
LONG = 5.0  # s, to read a study

# what stands where something else was
NUMBERS = (
    0, -1, 1, 2**31, 2**63, 2**64, 2**70, 10**12, 10**26, 10**400, 6 * 10**7, -(10**18),
    0.0, -0.0, 1e-320, 1e-300, 1e-9, 0.5, 1e30, 1e300, -1e300, float("inf"),
    float("nan"),
)  # fmt: skip
TEXTS = (
    "", " ", "\0", "\n", "\x1b[31mred\x1b[0m", "\u202eabc", "=1+1", "[/]", "[bold]x",
    "$\\foo{ a$", "<script>alert(1)</script>", "a" * 300, "a" * 200_000, "9" * 5000,
    "é" * 50, "../../etc/passwd", "/dev/zero", "/dev/stdin", "/etc/passwd", ".", "~",
    "__import__('os').system('x')", "(" * 400 + "1" + ")" * 400, "1" + "+1" * 400,
    "9**9**9", "nan", "inf", "+-nan mm", "+-1e400 mm", "+-1e308 km", "<= 1e308 kN",
    "1..1 mm", "2..1 mm", "+-0 mm", "+--1 mm", "1e-330 m", "IT7", "IT99", "H0", "js12",
    "+-1 furlong", "+-1 m^9", "+-1 mm mm mm", "m " * 4000, "1,2 mm", "0x10 mm",
    "true", "normal", "saltelli", "grid", "table", "latin", "sobol", "rods.csv",
    "p95", "yaw p95 +-2 %", "yaw p100 +-0 %", "gap beyond +-1e-300 pp", "deviations",
)  # fmt: skip
OTHERS: tuple[Any, ...] = (
    True, False, [], {}, [[]], [{}], {"": 1}, {"a": {"b": {"c": 1}}}, [1, "a", [2]],
    datetime.date(1979, 5, 27), datetime.time(7, 32), datetime.datetime(1979, 5, 27),
    [1] * 5000, {f"k{i}": i for i in range(2000)},
)  # fmt: skip
KEYS = (
    "", "a", "\0", "\x1b[31m", "a\nb", "[/]", "title", "model", "trials", "seed",
    "sampling", "table", "settings", "links", "deviations", "correlation", "grid",
    "reference", "limits", "tolerance", "distribution", "cp", "cpk", "shift", "mode",
    "plateau", "alpha", "beta", "median", "shape", "value", "outside", "data", "column",
    "unit", "nominal", "fit", "common", "iso1328", "module", "size", "yield", "ppm",
    "ppk", "limit", "until", "at_most", "from", "to", "points", "label", "trial",
    "status", "__class__", "gap", "rod_length", "rod_length_1", "x" * 5000,
)  # fmt: skip
TEXTUAL = (  # of the file, not of what it holds
    lambda text, dice: text[: dice.randrange(len(text))],
    lambda text, dice: text.replace(dice.choice('"=[].{},'), "", 1),
    lambda text, dice: "x = " + "[" * 3000 + "]" * 3000 + "\n" + text,
    lambda text, dice: "x = " + "{a=" * 900 + "1" + "}" * 900 + "\n" + text,
    lambda text, dice: "a." * 3000 + "b = 1\n" + text,
    lambda text, dice: "x = " + "9" * 5000 + "\n" + text,
    lambda text, dice: text + "x" * 2_000_000,
    lambda text, dice: "\ufeff" + text,
    lambda text, dice: text + '\n[deviations]\nrod_length = "+-1 mm"\n',
    lambda text, dice: _flipped(text, dice),
)


class Mutant(NamedTuple):
    """A study with a mistake.

    Attributes
    ----------
    number : int
        It comes again with it.
    seed : Path
        The study that it was.
    what : str
        What was done to it.
    content : bytes
        Of its file.
    """

    number: int
    seed: Path
    what: str
    content: bytes


def studies() -> list[Path]:
    """List the studies that are changed."""
    return sorted([*ROOT.glob("runs/*.toml"), *ROOT.glob("runs/own/*.toml")])


def mutants(count: int) -> Iterator[Mutant]:
    """Make mutants, always the same."""
    seeds = [(path, path.read_text()) for path in studies()]
    for number in range(count):
        dice = random.Random(number)
        path, text = seeds[number % len(seeds)]
        if dice.random() < 0.1:
            change = dice.randrange(len(TEXTUAL))
            changed = TEXTUAL[change](text, dice)
            if isinstance(changed, str):
                changed = changed.encode()
            yield Mutant(number, path, f"text {change}", changed)
            continue
        table = tomllib.loads(text)
        done = [_changed(table, dice) for _ in range(dice.choice((1, 1, 1, 2, 3)))]
        yield Mutant(number, path, "; ".join(done), tomli_w.dumps(table).encode())


def _flipped(text: str, dice: random.Random) -> bytes:
    """Change some bytes."""
    content = bytearray(text.encode())
    for _ in range(dice.randint(1, 4)):
        content[dice.randrange(len(content))] = dice.randrange(256)
    return bytes(content)


def _places(table: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every table or list with each of its keys."""
    items = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in items:
        yield table, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _changed(table: dict[str, Any], dice: random.Random) -> str:
    """Make one mistake in a study, and say which."""
    places = list(_places(table))
    if not places:
        table["model"] = _other(dice)
        return "model"
    where, key = dice.choice(places)
    if dice.random() < 0.5:  # deeper down there is more to be said
        where, key = dice.choice([p for p in places if _is_leaf(p)] or places)
    tables = [table, *(of[k] for of, k in places if isinstance(of[k], dict))]
    kind = dice.choice(("replace", "remove", "add", "move", "text", "text", "number"))
    if kind == "remove":
        del where[key]
    elif kind == "add":
        where, key = dice.choice(tables), dice.choice(KEYS)
        where[key] = _other(dice)
    elif kind == "move":
        other, there = dice.choice(places)
        where[key] = copy.deepcopy(other[there])
    elif kind == "number" and not isinstance(where[key], str | dict | list):
        where[key] = dice.choice(NUMBERS)
    elif kind in ("text", "number") and isinstance(where[key], str):
        where[key] = _misspelt(where[key], dice)
    else:
        where[key] = _other(dice)
    return f"{kind} {key!r:.40}"


def _is_leaf(place: tuple[Any, Any]) -> bool:
    where, key = place
    return not isinstance(where[key], dict | list)


def _other(dice: random.Random) -> Any:
    value = dice.choice(dice.choice((NUMBERS, TEXTS, OTHERS)))
    return copy.deepcopy(value)


def _misspelt(text: str, dice: random.Random) -> str:
    """Change a number in a text, or its letters."""
    if found := list(re.finditer(r"[0-9.]+", text)):
        start, stop = dice.choice(found).span()
        number = dice.choice(
            ("0", "-1", "1e99", "1e400", "1e-99", "1e12", "1e-12", "150", "", "9" * 400)
        )
        return text[:start] + number + text[stop:]
    at = dice.randrange(len(text) + 1)
    return text[:at] + dice.choice(("", "x", " ", "\x1b", "+-", "[")) + text[at + 1 :]


def folder_of(mutant: Mutant, folder: Path) -> Path:
    """Write a mutant beside the data and the machines that its study has there."""
    for path in (*mutant.seed.parent.glob("*.csv"), *mutant.seed.parent.glob("*.py")):
        if not (folder / path.name).exists():
            (folder / path.name).write_bytes(path.read_bytes())
    study = folder / f"mutant_{mutant.number}.toml"
    study.write_bytes(mutant.content)
    return study


def wrong_of_reading(mutant: Mutant, folder: Path) -> tuple[str, bool]:
    """Read a mutant; return what is wrong with that, and whether it is a study."""
    study = folder_of(mutant, folder)
    model = None
    if mutant.seed.stem in OWN:
        model = catalogue.load(str(ROOT / "runs" / "own" / OWN[mutant.seed.stem]))
    began = time.monotonic()
    try:
        load(study, model=model)
        wrong, right = "", True
    except StudyError as error:
        wrong, right = wrong_of_message(str(error), study, mutant), False
    except TolstatError as error:
        wrong, right = f"not refused as a study: {type(error).__name__}: {error}", False
    except Exception as error:
        wrong, right = f"{type(error).__name__}: {error}", False
    if (seconds := time.monotonic() - began) > LONG:
        wrong += f"; took {seconds:.1f} s"
    study.unlink()
    return wrong, right


def wrong_of_message(message: str, study: Path, mutant: Mutant) -> str:
    """Say what a refusal lacks: the file, a key or a line; that it can be read."""
    if str(study) not in message and study.name not in message:
        return f"names no file: {message[:200]}"
    if len(message) > 30_000:
        return f"{len(message)} characters long"
    said = message.replace(str(study), "").replace(study.name, "")
    keys = {*Document.model_fields, *KEYS[3:]} - {"", "a"}
    known = any(re.search(rf"\b{re.escape(key)}\b", said) for key in keys)
    about_the_file = (
        "(at line",
        "(at end of document",
        "is not UTF-8",
        "NUL bytes",
        "larger than",
    )
    if known or any(words in said for words in about_the_file):
        return ""
    held = re.findall(r"^\s+(\[.+?\] .+?|\S.*?)(?: = |: )", said, flags=re.MULTILINE)
    return "" if held else f"names no key: {message[:300]}"


def wrong_of_running(mutant: Mutant, folder: Path) -> str:
    """Run a mutant by the command line; return what is wrong with how it ends."""
    import resource

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))

    study = folder_of(mutant, folder)
    words = [sys.executable, "-c", COMMAND, "run", study.name]
    if mutant.seed.stem in OWN:
        words += ["--machine", OWN[mutant.seed.stem]]
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        words, cwd=folder, capture_output=True, preexec_fn=bounded, timeout=120,
        stdin=subprocess.DEVNULL, env={**os.environ, **one_thread}, check=False,
    )  # fmt: skip
    said = done.stderr.decode(errors="replace")
    study.unlink()
    if "Traceback" in said or "\x1b" in said:
        return f"exit {done.returncode}: {said[-600:]}"
    if done.returncode != 2:
        return f"exit {done.returncode}, not 2: {said[-300:]}"
    return wrong_of_message(said, study, mutant)


def main() -> int:
    """Read and run all of them."""
    failed, refused = 0, []
    with tempfile.TemporaryDirectory() as name:
        for mutant in mutants(READ):
            wrong, right = wrong_of_reading(mutant, Path(name))
            refused += [] if right else [mutant]
            if wrong:
                failed += 1
                print(f"{mutant.number} {mutant.seed.name}, {mutant.what}: {wrong}")
        print(f"{READ} read: {len(refused)} refused, {failed} wrongly", flush=True)
        step = max(1, len(refused) // RUN)
        chosen = refused[::step][:RUN]
        for mutant in chosen:
            if wrong := wrong_of_running(mutant, Path(name)):
                failed += 1
                print(f"{mutant.number} {mutant.seed.name}, {mutant.what}: {wrong}")
        print(f"{len(chosen)} run; {failed} wrong in all")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
