"""A page of each kind: python -m tests.answers.every_page FOLDER."""

from __future__ import annotations

import re
import sys
from contextlib import chdir
from pathlib import Path

from click.testing import CliRunner

import tolstat
from tests.conftest import ROOT
from tolstat.cli.main import main

STUDY = (ROOT / "runs" / "stack-up.toml").read_text().replace("10000", "2000")
GRID = """
model = "dimension_chain"
sampling = "grid"
settings.gap = "H - a"
links = { H = { nominal = "10 mm" }, a = { nominal = "9 mm" } }
grid = { H = { from = "-1 mm", to = "1 mm", points = 9 }, a = ["0 mm", "0.5 mm"] }
limits.gap = ">= 0.05 mm"
"""
PRICE = 'cost = { law = "reciprocal", at = "+-0.12 mm", price = 10 }'
PRICED = STUDY.replace('"+-0.12 mm" }', f'"+-0.12 mm", {PRICE} }}')
RARE = STUDY.replace("2000", '5000\nsampling = "rare"').replace(
    '"0.2..0.6 mm"', '{ limit = "<= 0.7 mm", ppm = 10 }'
)
CASES = (ROOT / "runs" / "cases.toml").read_text()
CASES = CASES.replace("20000", "2000").replace("points = 9", "points = 2")
MEASURED = (ROOT / "runs" / "measured-parts.toml").read_text()
MEASURED = re.sub(r"trials = \d+", "trials = 2000", MEASURED)
SLIDE = (ROOT / "runs" / "slider-crank.toml").read_text()
SLIDE = re.sub(r"trials = \d+", "trials = 500", SLIDE)
STUDIES = {
    "stack": STUDY, "other": STUDY.replace("120.3", "120.26"), "grid": GRID,
    "rare": RARE, "cases": CASES, "priced": PRICED,
    "parts": MEASURED,
    "slide": SLIDE,
}  # fmt: skip
COMMANDS = (
    "batch stack.toml other.toml grid.toml rare.toml cases.toml parts.toml",
    "report stack.h5 -o relimit.html --limit gap<=0.55mm",
    "compare stack.h5 other.h5 -o compare.html",
    "what-if stack.h5 housing=h8 -o what-if.html",
    "what-if stack.h5 housing=h8 housing=h11 -o scenarios.html",
    "parts covers.csv --lots Charge -o covers.html",
    "explore stack.h5 -o explore.html",
    "runs . -o index.html",
    "run slide.toml",
    "trial slide.h5 0 --animate moving.html",
)


def pages(folder: Path) -> list[Path]:
    """Write studies, runs and a page of each kind into a folder."""
    for name, study in STUDIES.items():
        (folder / f"{name}.toml").write_text(study)
    covers = (ROOT / "runs" / "covers.csv").read_bytes()
    (folder / "covers.csv").write_bytes(covers)
    with chdir(folder):
        for command in COMMANDS:
            done = CliRunner().invoke(main, command.split())
            assert done.exit_code == 0, (command, done.output)
        tolstat.allocate("priced.toml", trials=4000).save("allocate.html")
    return sorted(folder.glob("*.html"))


if __name__ == "__main__":
    made = Path(sys.argv[1])
    made.mkdir(parents=True)
    print(*pages(made), sep="\n")
