"""Time and error of the default settings of the stand.

    python -m tests.studies.benchmarks.accuracy

256 machines drawn as in runs/khpt75.toml, at several settings, against rtol 1e-9 with a
step limit of 1e-4 s; and what the audit of such a run, at a thousandth of the default
rtol, says of its errors.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.deviations.drawing import draw
from tolstat.study.study import Study, load

STUDY = Path(__file__).parents[3] / "runs" / "khpt75.toml"
ENERGIES = ("drive", "slide", "guide", "roll", "spin", "damping", "contact")
PEAKS = (
    "rod_force", "rod_tension", "rod_compression", "shaft_9_moment", "shaft_12_moment",
    "mesh_force", "drive_moment", "yaw",
)  # fmt: skip
Responses = dict[str, NDArray[np.float64]]


def machines(study: Study, trials: int) -> NDArray[np.float64]:
    """Draw machines as the study does."""
    names = [contributor.name for contributor in study.description.contributors]
    return draw(
        names, study.deviating.distributions, sampling=study.sampling,
        seed=study.seed or 0, trials=trials,
    )  # fmt: skip


def responses(
    study: Study, deviations: NDArray[np.float64], rtol: float, max_step: float
) -> tuple[Responses, NDArray[np.int64]]:
    """Simulate machines at an integration tolerance."""
    settings = replace(study.settings, rtol=rtol, max_step=max_step)
    outcome = study.model.evaluate(deviations, settings)
    values, steps = outcome.responses, outcome.steps
    names = [response.name for response in study.description.responses]
    return dict(zip(names, values.T, strict=True)), steps


def errors(found: Responses, truth: Responses) -> dict[str, float]:
    """Compare in the measures of the accuracy bounds."""
    drive = truth["drive_energy"]
    energy = max(
        np.max(np.abs(found[f"{e}_energy"] - truth[f"{e}_energy"]) / drive)
        for e in ENERGIES
    )
    peaks = [
        name for name in truth if name.startswith(PEAKS) and np.all(truth[name] > 0)
    ]
    relative = {p: np.abs(found[p] / truth[p] - 1) for p in peaks}
    return {
        "energy": energy,
        "loss": np.max(np.abs(found["extra_loss"] - truth["extra_loss"])),
        "loss_run": np.max(np.abs(found["extra_loss_run"] - truth["extra_loss_run"])),
        "jam": np.max(np.abs(found["jam_share"] - truth["jam_share"])),
        "peak mean": max(float(np.mean(each)) for each in relative.values()),
        "peak worst": max(float(np.max(each)) for each in relative.values()),
        "residual": np.max(np.abs(found["energy_residual"])),
    }


def claimed(
    study: Study, deviations: NDArray[np.float64], truth: Responses
) -> dict[str, float]:
    """Return what an audit calls the largest error, as a share of what it is."""
    found, again = (
        responses(study, deviations, settings.rtol, settings.max_step)[0]
        for settings in (study.settings, study.model.tightened(study.settings))
    )
    return {
        name: float(
            np.max(np.abs(found[name] - again[name]))
            / np.max(np.abs(found[name] - truth[name]))
        )
        for name in truth
        if np.any(found[name] != truth[name])  # not what is zero without play
    }


# further settings, on the 24 of 4096 machines that jam longest and 24 others
FURTHER: tuple[dict[str, object], ...] = (
    {},
    {"variant": "equalized"},
    {"drive": "balanced"},
    {"crank_speed": 3.0},
    {"crank_speed": 12.0},
    {"contact_yaw": 5.8e-4},
    {"start_up": 0.2},
)


def jammed(study: Study) -> NDArray[np.float64]:
    """Pick the machines that jam longest, and as many others."""
    deviations = machines(study, 4096)
    found, _ = responses(
        study, deviations, study.settings.rtol, study.settings.max_step
    )
    return deviations[[*np.argsort(-found["jam_share"])[:24], *range(24)]]


BOUNDS = {
    "energy": 1e-4,
    "loss": 5e-5,
    "loss_run": 5e-5,
    "jam": 2e-3,
    "peak mean": 2e-3,
    "peak worst": 3e-3,
    "residual": 1e-5,
}


def main() -> None:
    """Print one line for each setting."""
    study = load(STUDY)
    deviations = machines(study, 256)
    truth, _ = responses(study, deviations, 1e-9, 1e-4)
    print(f"{'rtol':>8} {'max_step':>8} {'steps':>8} {'trials/s':>8}", *BOUNDS)
    print(" " * 36, *(f"{bound:.1e}" for bound in BOUNDS.values()))
    default = (study.settings.rtol, study.settings.max_step)
    caps = [(default[0], cap) for cap in (5e-4, 1.25e-3, 2e-3)]
    others = [*caps, *((rtol, default[1]) for rtol in (3e-3, 3e-4, 1e-4, 1e-5))]
    for rtol, max_step in [default, *others]:
        began = time.perf_counter()
        found, steps = responses(study, deviations, rtol, max_step)
        rate = len(deviations) / (time.perf_counter() - began)
        measured = " ".join(f"{value:.1e}" for value in errors(found, truth).values())
        print(f"{rtol:8.0e} {max_step:8.1e} {steps.mean():8.0f} {rate:8.0f} {measured}")
    picked = jammed(study)
    for each in FURTHER:
        other = replace(study, settings=replace(study.settings, **each))
        found, steps = responses(other, picked, *default)
        measured = errors(found, responses(other, picked, 1e-8, 2e-4)[0])
        words = " ".join(f"{value:.1e}" for value in measured.values())
        print(f"{each!s:27} {steps.mean():8.0f} {words}")
    share = claimed(study, deviations, truth)
    print("the audit's largest error, as a share of the true one, by response:")
    print(" ", ", ".join(f"{name} {value:.3f}" for name, value in share.items()))


if __name__ == "__main__":
    main()
