"""Draw the paper's Figs. 2 and 3: cranks 1 mm apart, three machines.

pip install .
python runs/pictures/loads.py
"""

from pathlib import Path

import matplotlib.pyplot as plt

import tolstat

CRANKS = {"crank_difference": 1e-3}  # m, the paper's dr
MACHINES = {
    "indeterminate": {"variant": "indeterminate"},
    "equalized": {"variant": "equalized"},
    "equalized and balanced": {"variant": "equalized", "drive": "balanced"},
}
COLOURS = ("#0072b2", "#d55e00", "#009e73")

moved = {
    name: tolstat.trajectory("stand", CRANKS, {"contact_yaw": 5.8e-4, **settings})
    for name, settings in MACHINES.items()
}
# one turn of the steady window
moved = {name: frame.loc[2.2:3.1] for name, frame in moved.items()}

plt.rcParams.update({"font.size": 11, "axes.spines.top": False})
plt.rcParams.update({"axes.spines.right": False})
figure, (upper, lower) = plt.subplots(
    2, 1, figsize=(9, 6.4), sharex=True, layout="constrained"
)
for (name, frame), colour in zip(moved.items(), COLOURS, strict=True):
    upper.plot(frame["shaft_9_moment"] / 1e3, color=colour, label=name)
title = "Fig. 2: moment of shaft 9, cranks 1 mm apart, guides that touch at 5.8e-4 rad"
upper.set_title(title, loc="left")
upper.set_ylabel("kN m")
frame = moved["indeterminate"]
lower.plot(frame["rod_force_1"] / 1e3, color=COLOURS[0], label="rod 1, indeterminate")
lower.plot(
    frame["rod_force_2"] / 1e3, color=COLOURS[0], ls="--", label="rod 2, indeterminate"
)
lower.plot(
    moved["equalized"]["rod_force_1"] / 1e3, color=COLOURS[1], label="both, equalized"
)
lower.axhline(0, color="#b0b0b0", linewidth=0.8)
lower.set_title("Fig. 3: elastic forces in the rods, tension positive", loc="left")
lower.set(xlabel="time, s", ylabel="kN")
for axes in (upper, lower):
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))

figure.savefig(Path(__file__).with_name("loads.png"), dpi=110)
