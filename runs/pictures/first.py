"""Draw the energy lost at the guides over the difference of the rods.

pip install .
tolstat run runs/first.toml
python runs/pictures/first.py
"""

from pathlib import Path

import matplotlib.pyplot as plt

import tolstat

RUNS = Path(__file__).parents[1]

run = tolstat.open(RUNS / "first.h5")
frame, limit = run.frame(), run.limits["extra_loss"]
difference = 1e3 * (frame["rod_length_1"] - frame["rod_length_2"])

plt.rcParams.update({"font.size": 11, "axes.spines.top": False})
plt.rcParams.update({"axes.spines.right": False})
figure, axes = plt.subplots(figsize=(9, 3), layout="constrained")
axes.plot(difference, 100 * frame["extra_loss"], ".", color="#c1432e", markersize=4)
axes.axhline(100 * limit.upper, color="black", linewidth=1, linestyle="--")
axes.text(0, 100 * limit.upper + 0.2, f"limit {limit.words}", ha="center")
axes.set(xlabel="rod 1 longer than rod 2 by, mm", ylabel="lost at the guides, %")

figure.savefig(RUNS / "pictures" / "first.png", dpi=110)
