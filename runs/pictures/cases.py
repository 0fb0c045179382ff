"""Draw the play of a shaft, and its fraction out of limit, over the temperature.

pip install .
tolstat run runs/cases.toml
python runs/pictures/cases.py
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import tolstat

RUNS = Path(__file__).parents[1]

run = tolstat.open(RUNS / "cases.h5")
report = tolstat.report(run)
dT = np.linspace(-60, 100, len(run.responses))
limited = [response.limited for response in report.responses.values()]
shares = [limit.yields.fraction_out_of_limit for limit in limited]
value, lower, upper = 1e6 * np.array([share[:3] for share in shares]).T

plt.rcParams.update({"font.size": 11, "axes.spines.top": False})
plt.rcParams.update({"axes.spines.right": False})
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
for i in range(200):
    left.plot(dT, 1e3 * run.frame().iloc[i][list(run.limits)], color="#3b6ea8", lw=0.3)
limit = limited[0].limit
for end in limit.permitted:
    left.axhline(1e3 * end, color="black", linewidth=1, linestyle="--")
left.set(xlabel="warmer than 20 °C by, K", ylabel="play of 200 units, mm")
right.fill_between(dT, np.maximum(lower, 0.1), upper, alpha=0.25, color="#c1432e")
right.plot(dT, np.where(value > 0, value, np.nan), ".-", color="#c1432e")
right.axhline(2700, color="black", linewidth=1, linestyle="--")
right.text(-60, 2700 * 1.2, "permitted")
right.set(xlabel="warmer than 20 °C by, K", ylabel="out of limit, ppm", yscale="log")
figure.savefig(RUNS / "pictures" / "cases.png", dpi=110)
