"""Write validation.md: what the papers print beside what tolstat computes.

pip install .
python runs/validation.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

import tolstat

RUNS = Path(__file__).parent

TEXT = """# Validation: the papers' figures and tables

Each table has the paper's numbers beside tolstat's. `python runs/validation.py`
computes this page again; a test compares it.

## The stand

E. Ya. Antonyuk, A. G. Zabuga, 2012. The paper prints curves, no tables. Two
independent implementations of its equations gave the numbers for comparison.
[`test_stand_reference.py`](../tests/machines/test_stand_reference.py) compares eight
machines with them, 21 responses each: all 168 numbers agree to 1e-4.

### Fig. 2: the moment of shaft 9

Cranks 1 mm apart, largest moment of shaft 9 in N m. The paper says: the equalized
machine has a somewhat higher moment than the machine as built. This depends on the
yaw at which the guides touch. It holds below 7.511e-4 rad and reverses above.

{moment}

Opening the second loop alone lowers the moment only above 0.63 mrad. The curves are in
the [gallery](README.md#the-stand). *`python runs/pictures/loads.py`, `tolstat run
runs/khpt75-fig2.toml`*

### Fig. 3: the forces in the rods

The same cranks, largest forces in kN, guides that touch at 5.8e-4 rad. The paper
says: the rods of the machine as built carry unequal forces, the equalizing link makes
them equal. Both hold.

{forces}

### Fig. 4: the energy lost

Cranks of different radius, energy lost to guide friction from standstill to the end,
guides that touch at 5.8e-4 rad. The paper says: no loss below 0.5 mm, then nearly
linear, about 8 % at 3 mm. *`tolstat run runs/khpt75-fig4.toml`, `tolstat export
runs/khpt75-fig4.h5 -o fig4.csv`*

{loss}

### Play in the joints of the rods

The paper names clearances only as what permits motion; the law of contact is assumed.
An independent integration with located contacts gave the numbers in brackets. L1: play
of 0.2 mm at both rods. L2: cranks 1 mm apart, guides that touch at 5.8e-4 rad, play of
0.3 and 0.1 mm. L3: equalized, cranks 1 mm apart, play of 0.2 and 0.3 mm. *`python
runs/validation.py`*

{play}

Without play L2 loses 1.81 %. Play relieves where it is larger at the rod on the shorter
crank. Equal play at both rods hardly changes the loss. *`tolstat run
runs/khpt75-play.toml`*

Two more machines, with other constants and with deviations of hinges, inertia, dampings
and guides, are met as well. *`pytest -n 0 tests/machines/test_stand_reference.py`*

## The ring

A. I. Polunin, 2012. Smallest depth of cut in mm over 3 s, all 18 cells of the paper's
table. Values that the paper does not give are inferred: the handbook's cutting
coefficients, the duration, and the inner radius of 3 m. The largest difference is
{worst} mm. *`tolstat run runs/ring-table.toml`*

{ring}

Figs. 3 and 4, rings of 50 mm on supports at 40 deg: the speed at which the lowest
frequency is zero, and the speed from which it flutters, in rad/s. Without damping the
zero lies at 2 sqrt(nu). *`tolstat view runs/ring-spectrum.toml spectrum -o
runs/pictures/ring-spectrum.png`*

{speeds}

![Lowest frequency and growth of rings over their speed](pictures/ring-spectrum.png)

Speeds at which harmonic j has no stiffness, ring of 3 m, and the growth there. The
paper has the formula Omega_j = j sqrt(nu). *`tolstat view runs/ring-spectrum.toml
critical`* gives those of its ring.

{critical}

The forces of the rollers on the ring, outwards, without gravity: case A, 3.025 m, 50
mm, 1e5 N/m. Independent code integrated all coordinates with two constraints. The dead
load on each roller is 47 463 N: both hold.

{rollers}

The paper calls the zero a resonance. The model leaves out the tension of the spinning
ring; with `hoop = true` there is neither a zero nor flutter.

## The rolling block

P. V. Krot, 2010, Table 1: natural frequencies of nine masses. The paper prints no
inertias and stiffnesses; they were identified from this table. One sign is a
misprint: mass 2 in mode 1 is -0.130. *`tolstat view runs/rolling-block.toml shapes`*

{block}

The shape is the largest difference of any mass from the printed mode shape, with that
sign and with 0 for the printed 0.001.

Ranges over the 128 combinations of the gearbox. It is the smallest with the printed
ratios; the printed inertias are a check, which Table 1 does not permit to be met.
*`tolstat view runs/rolling-block-campbell.toml gearbox -o gearbox.csv`*

{ranges}

Above 120 m/s in the last stand the paper permits no rolling. This cuts {cut} of the 128
below 1700 rpm, with rolls of 156 mm. The condition number f8/f1 is above 10 in {hard}
of them. Modes 3 and 4, 25.16 Hz and 31.83 Hz, are the same in all.
*`tolstat view runs/rolling-block-campbell.toml combinations -o combinations.csv`*

{combinations}

Frequency functions of mesh errors, tension and unbalance, damping by link, random
torques and travelling pulses have no printed numbers. Independent code gave some; the
tests [`channels`](../tests/machines/test_rolling_block_channels.py) and
[`torques`](../tests/machines/test_rolling_block_torques.py) compare them.

## The elastic machine

Semenov, Semenova, 2024: two masses, started at constant acceleration. Closed forms of
the paper beside the integration at rtol 1e-10.

{elastic}
"""

PAPER_RING = pd.read_csv(RUNS / "ring-table.csv", comment="#")
PAPER_BLOCK = pd.read_csv(
    RUNS / "rolling-block-table.csv", comment="#", index_col="mass"
)
MACHINES = {
    "as built": {},
    "equalized": {"variant": "equalized"},
    "balanced": {"drive": "balanced"},
    "equalized and balanced": {"variant": "equalized", "drive": "balanced"},
}
CRANKS = {"crank_difference": 1e-3}  # m
FIG_4 = {"contact_yaw": 5.8e-4}  # rad
# deviations, settings, and numbers of the independent integration
PLAY = {
    "L1": (
        {"joint_clearance": 2e-4},
        {},
        (9.744628e-9, 103042.86, 0.02668695, 0.03486157),
    ),
    "L2": (
        {**CRANKS, "joint_clearance_1": 3e-4, "joint_clearance_2": 1e-4},
        FIG_4,
        (0.012013484, 117693.16, 0.03131990, 0.04501251),
    ),
    "L3": (
        {**CRANKS, "joint_clearance_1": 2e-4, "joint_clearance_2": 3e-4},
        {"variant": "equalized"},
        (0.0, 102387.94, 0.06441661, 0.03718797),
    ),
}


def table(heads, rows):
    """Return a table of a page."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def stand(machine, yaw):
    """Return the responses of the stand with cranks 1 mm apart, at a contact yaw."""
    settings = {**MACHINES[machine], "contact_yaw": yaw, "rtol": 1e-6}
    return tolstat.evaluate("stand", CRANKS, settings).iloc[0]


def moment():
    """Return Fig. 2 at three contact yaws."""
    yaws = {"5.8e-4 rad": 5.8e-4, "7.511e-4 rad": 7.511e-4, "geometric": None}
    rows = [
        [name, *(f"{stand(name, yaw)['shaft_9_moment']:.0f}" for yaw in yaws.values())]
        for name in MACHINES
    ]
    return table(["machine", *yaws], rows)


def forces():
    """Return Fig. 3."""
    rows = []
    for name in ("as built", "equalized"):
        found = stand(name, 5.8e-4)
        both = (found[f"rod_force_{i}"] / 1e3 for i in (1, 2))
        rows.append([name, *(f"{force:.1f}" for force in both)])
    return table(["machine", "rod 1", "rod 2"], rows)


def loss():
    """Return Fig. 4."""
    known = pd.read_csv(RUNS / "khpt75-fig4.csv", comment="#").to_numpy()
    found = tolstat.evaluate("stand", {"crank_difference": known[:, 0] * 1e-3}, FIG_4)
    rows = [
        [f"{mm:g}", f"{percent:g}", f"{100 * ours:.3f}"]
        for (mm, percent), ours in zip(known, found["extra_loss_run"], strict=True)
    ]
    return table(["difference, mm", "independent, %", "tolstat, %"], rows)


def play():
    """Return the machines with play in the joints."""
    shown = {
        "extra_loss": ("extra loss, %", 100, 5),
        "rod_force_1": ("rod 1, kN", 1e-3, 4),
        "approach_1": ("approach, mm/s", 1e3, 4),
        "free_share_1": ("free, %", 100, 4),
    }
    rows = []
    for case, (deviations, settings, known) in PLAY.items():
        tight = {**settings, "rtol": 1e-8, "max_step": 1e-4}
        found = tolstat.evaluate("stand", deviations, tight).iloc[0]
        cells = [
            f"{found[name] * size:.{digits}f} ({number * size:.{digits}f})"
            for (name, (_, size, digits)), number in zip(
                shown.items(), known, strict=True
            )
        ]
        rows.append([case, *cells, f"{found['contacts_1']:.0f} (4)"])
    return table(["case", *(head for head, *_ in shown.values()), "contacts"], rows)


def depths():
    """Return the smallest depths of the ring's table, mm."""
    settings = {"support_angle": np.radians(80.0), "ring_damping": 1e-4}
    settings |= {"tool_damping": 1e-4, "duration": 3.0, "inner_radius": 3.0}
    found = [
        tolstat.evaluate(
            "ring", None, {**settings, "thickness": h, "tool_stiffness": K}
        )
        for h, K in PAPER_RING.iloc[:, :2].to_numpy()
    ]
    return np.array([1e3 * each.iloc[0]["depth_min"] for each in found])


def ring(found):
    """Return the ring's table: a row for each thickness."""
    cells = [
        f"{ours:.3f} ({paper:g})"
        for ours, paper in zip(found, PAPER_RING["depth_min [mm]"], strict=True)
    ]
    sizes = sorted(set(PAPER_RING.iloc[:, 0]))
    rows = [[f"{h:g}", *cells[i::6]] for i, h in enumerate(sizes)]
    return table(["thickness, m", "1e5 N/m", "5e5 N/m", "1e6 N/m"], rows)


def speeds():
    """Return Figs. 3 and 4 of the ring."""
    rows = []
    for radius in (5.0, 4.0, 3.0):
        settings = {"radius": radius, "thickness": 0.05, "ring_damping": 0.0}
        settings |= {"support_angle": np.radians(40.0), "duration": 0.05}
        found = tolstat.evaluate("ring", None, settings).iloc[0]
        nu = 2.10e11 * 0.05**2 / (12 * 7800.0 * radius**4)
        rows.append(
            [
                f"{radius:g}",
                f"{2 * nu**0.5:.4f}",
                f"{found['zero_speed']:.4f}",
                f"{found['flutter_speed']:.4f}",
            ]
        )
    return table(["radius, m", "2 sqrt(nu)", "zero", "flutter"], rows)


def critical():
    """Return the critical speeds of the harmonics of the ring of 3 m."""
    settings = {"radius": 3.0, "thickness": 0.05, "ring_damping": 0.0}
    settings |= {"support_angle": np.radians(40.0)}
    found = tolstat.view("ring", "critical", settings=settings).frame()
    root = (2.10e11 * 0.05**2 / (12 * 7800.0 * 3.0**4)) ** 0.5
    rows = [
        [f"{j:.0f}", f"{j * root:.4f}", f"{speed:.4f}", f"{growth:.3f}"]
        for j, speed, growth in found.to_numpy()[:, :3]
    ]
    return table(["j", "j sqrt(nu), rad/s", "tolstat, rad/s", "growth, 1/s"], rows)


def rollers():
    """Return the extremes of the rollers' forces in case A."""
    settings = {"radius": 3.025, "thickness": 0.05, "tool_stiffness": 1e5}
    found = tolstat.evaluate("ring", None, {**settings, "rtol": 1e-10}).iloc[0]
    known = {
        "roller_1_min": -770.3047, "roller_1_max": 712.4627,
        "roller_2_min": -353.3061, "roller_2_max": 773.0133,
    }  # fmt: skip
    rows = [[name, f"{N:.2f}", f"{found[name]:.2f}"] for name, N in known.items()]
    return table(["response", "independent, N", "tolstat, N"], rows)


def every_combination():
    """Return the listing of the combinations, with their inertia."""
    found = tolstat.view("rolling_block", "combinations").frame()
    inertia = tolstat.view("rolling_block", "gearbox").frame()["sum of Q"]
    return found.assign(inertia=inertia, rpm=found["limit of v34"] * 30 / np.pi)


def ranges(found):
    """Return what the paper prints of all combinations."""
    printed = {
        "ratio, stands 31, 32": ("i31", "0.1572..1.2173", 4),
        "ratio, stands 33, 34": ("i34", "0.0778..0.5330", 4),
        "inertia, kg m2": ("inertia", "316..2195", 0),
    }
    rows = [
        [words, paper, f"{found[name].min():.{n}f}..{found[name].max():.{n}f}"]
        for words, (name, paper, n) in printed.items()
    ]
    return table(["range", "paper", "tolstat"], rows)


def combinations(found):
    """Return each combination: what it changes."""
    hz = [f"f{r}" for r in (1, 2, 5, 6, 7, 8)]
    rows = [
        [
            row["combination"],
            *(f"{row[f]:.2f}" for f in hz),
            f"{row['condition f8/f1']:.2f}",
            f"{row['inertia']:.1f}",
            f"{row['rpm']:.0f}",
        ]
        for _, row in found.iterrows()
    ]
    heads = [*(f"{f}, Hz" for f in hz), "f8/f1", "kg m2", "120 m/s, rpm"]
    return table(["combination", *heads], rows)


def block():
    """Return Table 1 of the rolling block."""
    found = tolstat.evaluate("rolling_block").iloc[0]
    shapes = tolstat.view("rolling_block", "shapes").frame().to_numpy()
    off = np.abs(shapes - PAPER_BLOCK.to_numpy()).max(axis=0)
    rows = [
        [
            i,
            hz.removesuffix(" Hz"),
            f"{found[f'frequency_{i}']:.2f}",
            f"{off[i - 1]:.4f}",
        ]
        for i, hz in enumerate(PAPER_BLOCK, 1)
    ]
    return table(["mode", "paper, Hz", "tolstat, Hz", "shape"], rows)


def elastic():
    """Return the two masses of the elastic machine."""
    settings = {
        "inertia": (4.0, 2.0),
        "stiffness": (1600.0, 800.0),
        "damping": (0.0, 0.0),
        "final_speed": 12.0,
        "start_up_time": 1.2,
        "load_torque": (),
        "rtol": 1e-10,
    }
    found = tolstat.evaluate("elastic_machine", None, settings).iloc[0]
    k_1 = (0.5 * 800.0 / 2.0) ** 0.5
    closed = {
        "natural frequency 1, Hz": (k_1 / (2 * np.pi), found["frequency_1"]),
        "natural frequency 2, Hz": (k_1 / np.pi, found["frequency_2"]),
        "peak error of mass 2, rad: 16/3 J eps0/c": (16 / 120, found["error_2"]),
        "dynamic factor of mass 2: 32/15": (32 / 15, found["dynamic_factor_2"]),
    }
    rows = [[words, f"{a:.8f}", f"{b:.8f}"] for words, (a, b) in closed.items()]
    return table(["number", "closed form", "tolstat"], rows)


def page():
    """Return the text of the page."""
    found, every = depths(), every_combination()
    worst = np.abs(found - PAPER_RING["depth_min [mm]"].to_numpy()).max()
    return TEXT.format(
        moment=moment(), forces=forces(), loss=loss(), play=play(), ring=ring(found),
        worst=f"{worst:.3f}", speeds=speeds(), block=block(), elastic=elastic(),
        critical=critical(), rollers=rollers(), ranges=ranges(every),
        cut=(every["rpm"] < 1700).sum(), combinations=combinations(every),
        hard=(every["condition f8/f1"] > 10).sum(),
    )  # fmt: skip


if __name__ == "__main__":
    (RUNS / "validation.md").write_text(page())
