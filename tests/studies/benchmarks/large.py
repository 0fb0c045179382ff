"""Run and report a study of many contributors and limits, and print what it takes.

    python -m tests.studies.benchmarks.large 1000 100 1000

Contributors, limited responses, trials. The model is a stack of plates: its responses
are heights of faces, each the sum of all plates below it. Prints seconds of the
processor, peak memory in GB, the size of the file in MB and the number of its objects,
after the run and after each part of the report.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np

import tolstat
from tests.studies.benchmarks.many import peak_memory
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response


class Stack(Model):
    """A stack of plates: heights of faces at equal distances."""

    name = "stack"
    title = "heights of faces in a stack of plates"

    def __init__(self, plates: int, faces: int) -> None:
        self.plates, self.faces = plates, faces

    def describe(self, settings):
        return Description(
            tuple(Contributor(f"plate_{i}", "m") for i in range(1, self.plates + 1)),
            tuple(Response(f"height_{i}", "m") for i in range(1, self.faces + 1)),
        )

    def evaluate(self, deviations, settings):
        faces = np.arange(1, self.faces + 1) * (self.plates // self.faces) - 1
        heights = np.cumsum(deviations, axis=1)[:, faces]
        return Outcome(heights + 200 * heights**2, np.ones(len(heights), np.int64))


def study_of(plates: int, faces: int, trials: int) -> dict[str, object]:
    """Return the study: limits at two sigma of each height, on both sides, mm."""
    sigmas = [0.01 / 3 * np.sqrt(i * plates / faces) for i in range(1, faces + 1)]
    ends = {f"height_{i}": 2 * sigma for i, sigma in enumerate(sigmas, 1)}
    return {
        "model": "stack",
        "trials": trials,
        "seed": 1,
        "deviations": {"plate": "+-0.01 mm"},
        "limits": {name: f"-{end:.4f} .. {end:.4f} mm" for name, end in ends.items()},
    }


def main() -> None:
    """Run, report, print."""
    plates, faces, trials = map(int, sys.argv[1:4])

    def tell(words: str) -> None:
        memory = peak_memory() / 1e9
        print(f"{words}: {time.process_time():.0f} s, {memory:.2f} GB", flush=True)

    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        model = Stack(plates, faces)
        tolstat.run(study_of(plates, faces, trials), model=model, output=path)
        tell("run")
        objects: list[str] = []
        with h5py.File(path) as file:
            file.visititems(lambda name, _: objects.append(name))
        print(f"file: {path.stat().st_size / 1e6:.1f} MB, {len(objects)} objects")
        report = tolstat.report(path)
        tell("report gathered")
        report.save(Path(folder) / "report.json")
        tell("report as JSON")
        report.save(Path(folder) / "report.html")
        tell("report as a page")


if __name__ == "__main__":
    main()
