"""Draw the histogram of each of three chains.

pip install .
for study in drawing shims suppliers; do tolstat run runs/$study.toml; done
python runs/pictures/chains.py
"""

from pathlib import Path

import tolstat

RUNS = Path(__file__).parents[1]

for name, response in (("drawing", "room"), ("shims", "play"), ("suppliers", "gap")):
    report = tolstat.report(tolstat.open(RUNS / f"{name}.h5"))
    figure = report.plot(f"Histogram of {response}")
    figure.savefig(RUNS / "pictures" / f"{name}.png", dpi=110)
