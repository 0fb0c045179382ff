"""Draw the README's picture from the two stored runs.

pip install .
tolstat run runs/khpt75.toml
tolstat run runs/khpt75-equalized.toml
python runs/pictures/twins.py
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import tolstat

RUNS = Path(__file__).parents[1]
AS_BUILT, LINKED = "#c1432e", "#2f6f9f"

as_built = tolstat.open(RUNS / "khpt75.h5")
linked = tolstat.open(RUNS / "khpt75-equalized.h5")
limits = as_built.limits
frame, equalized = as_built.frame(), linked.frame()

plt.rcParams.update({"font.size": 11, "axes.spines.top": False})
plt.rcParams.update({"axes.spines.right": False})
figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")

lowest, highest = frame["rod_force_1"].min(), frame["rod_force_1"].max()
bins = np.arange(lowest // 1e3, highest // 1e3 + 2, 0.5)
for runs, label, color in (
    (frame, "as built", AS_BUILT),
    (equalized, "equalized", LINKED),
):
    left.hist(
        runs["rod_force_1"] / 1e3, bins, label=label, color=color, alpha=0.6, log=True
    )
limit = limits["rod_force_1"].upper / 1e3
left.axvline(limit, color="black", linewidth=1, linestyle="--")
left.text(limit + 0.5, 30, f"limit {limit:g} kN", rotation=90, va="center")
left.axvline(as_built.nominal["rod_force_1"] / 1e3, color="black", linewidth=1)
left.text(as_built.nominal["rod_force_1"] / 1e3 + 0.5, 700, "nominal")
left.set(xlabel="peak force in rod 1, kN", ylabel="machines", ylim=(0.7, 1500))
left.legend(frameon=False, loc="center", bbox_to_anchor=(0.61, 0.75))
left.set_title("4096 mills, the same parts twice", loc="left")

# the chains fight hardest in the dead centres, where rod and crank are in line
rods = frame["rod_length_1"] - frame["rod_length_2"]
cranks = frame["crank_radius_1"] - frame["crank_radius_2"]
difference = 1e3 * (rods.abs() + cranks.abs())
right.plot(difference, 100 * frame["extra_loss"], ".", color=AS_BUILT, markersize=4)
right.axhline(
    100 * limits["extra_loss"].upper, color="black", linewidth=1, linestyle="--"
)
right.text(0.05, 100 * limits["extra_loss"].upper + 0.12, "limit 3 %")
right.set(
    xlabel="difference of rods and cranks, |l1 - l2| + |r1 - r2|, mm",
    ylabel="drive energy lost at the guides, %",
)
jammed = 100 * np.mean(frame["jam_share"] > 0)
right.set_title(f"the carriage jams in {jammed:.1f} % of them", loc="left")

figure.savefig(RUNS / "pictures" / "twins.png", dpi=110)
