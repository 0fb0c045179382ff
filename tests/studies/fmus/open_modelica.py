"""Mass_Damper, which OpenModelica made: co-simulation is wrong without a word.

Its FMU is in the wheel of gemseo-fmu (LGPL-3), which this script downloads but does not
install. python -m tests.studies.fmus.open_modelica
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import tolstat
from tolstat import catalogue

WHEEL = "gemseo-fmu==3.1.1"
INSIDE = "gemseo_fmu/problems/fmu_files/linux/Mass_Damper.fmu"


def downloaded(folder):
    """The FMU."""
    command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "-d", folder]
    subprocess.run([*command, WHEEL], check=True)
    (wheel,) = Path(folder).glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        return archive.extract(INSIDE, folder)


def main():
    with tempfile.TemporaryDirectory() as folder:
        model = catalogue.load(downloaded(folder))
        print(tolstat.new_study(model))
        for steps in (10, 100, 501, 1000, 10_000):
            settings = {"stop": 1.0, "max_step": 1 / steps}
            print(
                steps, "steps:", tolstat.evaluate(model, None, settings).to_dict("list")
            )
        exact = {"stop": 1.0, "model_exchange": True, "rtol": 1e-9}
        print("model exchange:", tolstat.evaluate(model, None, exact).to_dict("list"))
        name = tolstat.evaluate(model).columns[0]
        study = {
            "model": model.name, "trials": 100, "seed": 1,
            "settings": {"stop": "1 s", "max_step": f"{1 / 501!r} s"},
            "deviations": {"mass_m": "+-1 %"},
            "limits": {name: "<= 100"},
        }  # fmt: skip
        run = tolstat.run(study)
        report = tolstat.report(run)
        print(report.verdicts)
        print(report)


if __name__ == "__main__":
    main()
