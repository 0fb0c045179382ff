"""Draw what causes out-of-limit trials, and what halving the rods' tolerance gains.

pip install .
tolstat run runs/khpt75.toml
python runs/pictures/questions.py        # a fresh run with halved rods of another seed
"""

import tomllib
from pathlib import Path

import matplotlib.pyplot as plt

import tolstat

RUNS = Path(__file__).parents[1]
HALVED = {"rod_length": "+-0.6 mm"}
LEAST = 30  # ppm: what is below is drawn there

run = tolstat.open(RUNS / "khpt75.h5")
study = tomllib.loads((RUNS / "khpt75.toml").read_text("utf-8")) | {"seed": 76}
study["deviations"] |= HALVED
fresh = tolstat.run(study, output=RUNS / "khpt75-halved.h5", force=True)

frame, limit = run.frame(), run.limits["extra_loss"]
difference = 1e3 * (frame["rod_length_1"] - frame["rod_length_2"])
out = frame["extra_loss"] > limit.upper

plt.rcParams.update({"font.size": 11, "axes.spines.top": False})
plt.rcParams.update({"axes.spines.right": False})
figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 3.4), layout="constrained")
for some, color in ((~out, "#2f6f9f"), (out, "#c1432e")):
    loss = 100 * frame["extra_loss"][some]
    left.plot(difference[some], loss, ".", color=color, markersize=4)
left.axhline(100 * limit.upper, color="black", linewidth=1, linestyle="--")
left.text(0, 100 * limit.upper + 0.2, f"limit {limit.words}", ha="center")
left.set(xlabel="rod 1 longer than rod 2 by, mm", ylabel="energy lost, %")

weighted = tolstat.what_if(run, HALVED).responses
proved = tolstat.summary(fresh).responses
names = list(run.limits)
for place, (label, color, responses) in enumerate(
    (
        ("baseline", "#c1432e", {n: each.baseline for n, each in weighted.items()}),
        ("rods +-0.6 mm", "#2f6f9f", {n: x.scenario for n, x in weighted.items()}),
        ("fresh run", "#5b8c3a", proved),
    )
):
    for row, name in enumerate(names):
        share = responses[name].limited.yields.fraction_out_of_limit
        at = -row - 0.22 * (place - 1)
        ends = [max(1e6 * x, LEAST) for x in (share.lower, share.upper)]
        right.plot(ends, [at, at], "-", color=color, label=None if row else label)
        right.plot(max(1e6 * share.value, LEAST), at, "o", color=color, markersize=5)
right.set_yticks(range(0, -len(names), -1), names)
right.set(xscale="log", xlim=(LEAST, None), xlabel="out of limit, ppm")
right.legend(
    frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=3, fontsize=9
)
figure.savefig(RUNS / "pictures" / "questions.png", dpi=110)
