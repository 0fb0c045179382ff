"""Pages of explore beside what-ifs and fresh runs; their size, and processor time.

python -m tests.studies.benchmarks.exploring   # some minutes; prints two tables, needs node

The script of a page reads each scenario; `tolstat.what_if` answers the same; a fresh run
of the copied entries has another seed.
"""

import json
import shlex
import shutil
import subprocess
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import tolstat
from tolstat.cli.what_if import deviations_in

ROOT = Path(__file__).parents[3]
SCRIPT = ROOT / "tests" / "answers" / "explore" / "scenarios.js"
MOVES = 30  # of which the median time is printed
MM = 1e-3


class Case(NamedTuple):
    """Scenarios of a study, as states of entries in the script."""

    study: str
    trials: int
    response: str
    scenarios: tuple[dict[str, Any], ...]


CASES = (
    Case("stack-up", 10_000, "gap", (
        {"housing": {"half": 0.08 * MM}},
        {"housing": {"nominal": 120.26 * MM}},
        {"housing": {"kind": "uniform"}, "bearing_1": {"half": 0.04 * MM}},
        {"bearing_1": {"kind": "triangular", "shift": -0.02 * MM}})),
    Case("slider-crank", 20_000, "slide", (
        {"rod": {"half": 0.15 * MM}},
        {"rod": {"half": 0.17 * MM}, "crank": {"shift": 0.02 * MM}})),
    Case("khpt75", 4096, "extra_loss", (
        {"rod_length": {"half": 0.9 * MM}},
        {"crank_radius": {"half": 0.3 * MM}, "rod_length": {"half": 1.0 * MM}})),
)  # fmt: skip


def changed(study: dict[str, Any], toml: str) -> dict[str, Any]:
    """Return a study with the entries that a page copies."""
    for section, entries in tomllib.loads(toml).items():
        study[section] = {**study.get(section, {}), **entries}
    return study


def ppm(out: Any) -> str:
    """Return a fraction out of limit with its interval."""
    return "{:.0f} ({:.0f} to {:.0f})".format(*(1e6 * x for x in out))


def compared(case: Case, folder: Path) -> tuple[list[str], str]:
    """Return a row for each scenario of a case, and one of its page."""
    source = shutil.copy(ROOT / "runs" / f"{case.study}.toml", folder)
    run = tolstat.run(source, trials=case.trials)
    started = time.perf_counter()
    explored = tolstat.explore(run)
    page = explored.save(folder / f"{case.study}.html")
    seconds = time.perf_counter() - started
    changes = [{"entries": scenario} for scenario in case.scenarios]
    data, asked = folder / "data.json", folder / "changes.json"
    data.write_text(explored.data.text())
    # the others show how long a move takes once the script is warm
    half = next(iter(case.scenarios[0].values()))["half"]
    name = next(iter(case.scenarios[0]))
    moves = [{"entries": {name: {"half": half * (1 + i / 1000)}}} for i in range(MOVES)]
    asked.write_text(json.dumps([*changes, *moves]))
    call = ["node", str(SCRIPT), str(data), str(asked)]
    found = json.loads(subprocess.run(call, capture_output=True, check=True).stdout)
    rows = []
    for reading in found[: len(changes)]:
        words = reading["words"]
        answer = tolstat.what_if(
            run, deviations_in(words), evaluate=explored.data.evaluated
        )
        yields = answer.responses[case.response].scenario.limited.yields
        study = changed(tomllib.loads(run.study.text), reading["toml"])
        again = tolstat.run(
            {**study, "seed": study["seed"] + 1000, "trials": case.trials}
        )
        fresh = tolstat.summary(again).responses[case.response].limited.yields
        read = reading["responses"][case.response]
        cells = [
            ppm([read["share"], *read["range"]]),
            *(ppm(x.fraction_out_of_limit[:3]) for x in (yields, fresh)),
        ]
        rows.append(f"| {case.study} | {shlex.join(words)} | {' | '.join(cells)} |")
    times = sorted(move["milliseconds"] for move in found[len(changes) :])
    return rows, (
        f"| {case.study} | {case.trials} | {page.stat().st_size / 1e6:.2f} MB | "
        f"{seconds:.1f} s | {times[len(times) // 2]:.1f} ms |"
    )


def main() -> None:
    """Print both tables."""
    print("| study | scenario | explore, ppm | what-if, ppm | fresh run, ppm |")
    print("|---|---|---|---|---|")
    pages = []
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            rows, page = compared(case, Path(folder))
            print("\n".join(rows), flush=True)
            pages.append(page)
    print("\n| study | trials | page | written in | a move |\n|---|---|---|---|---|")
    print("\n".join(pages))


if __name__ == "__main__":
    main()
