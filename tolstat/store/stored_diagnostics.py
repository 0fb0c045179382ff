"""What a run says beyond its trials, and how it lies in the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.store.attributes import texts, write_texts

Array = NDArray[np.float64]
Members = tuple[str, ...]  # contributors, taken together


class WorstCase(NamedTuple):
    """The worst corner of the tolerances that was found.

    Attributes
    ----------
    value : float
        Of the response, SI; NaN if every machine tried failed.
    deviations : dict of str to float
        The machine, SI.
    tried, failed : int
        Machines simulated for it, and how many of these failed.
    """

    value: float
    deviations: Mapping[str, float]
    tried: int
    failed: int


class Worst(NamedTuple):
    """One of the worst trials of a response.

    Attributes
    ----------
    trial : int
        Its number.
    precise : float
        The response, evaluated more precisely, SI; NaN where that failed or cannot be.
    """

    trial: int
    precise: float


class Halved(NamedTuple):
    """The share beyond a limit with some tolerances halved, from weighted trials.

    Attributes
    ----------
    beyond : Estimate
        The share, or why it cannot be told.
    effective : int
        Number of trials that the weighted ones are worth; 0 without weights.
    """

    beyond: Estimate
    effective: int


@dataclass(frozen=True)
class Evidence:
    """What a run says beyond its trials.

    Attributes
    ----------
    slopes : dict of str to dict of str to float
        By response and contributor that deviates, at the nominal machine, SI.
    worst_cases : dict of str to dict of str to WorstCase
        By limited response and side: "least", "largest".
    worst : dict of str to list of Worst
        The worst ten trials of limited responses, the worst first.
    halved : dict of str to dict of Members to Halved
        By limited response and the contributors whose tolerances are halved, at once.
    missing : str
        Why there is none of it; empty if there is.
    """

    slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    worst_cases: Mapping[str, Mapping[str, WorstCase]] = field(default_factory=dict)
    worst: Mapping[str, list[Worst]] = field(default_factory=dict)
    halved: Mapping[str, Mapping[Members, Halved]] = field(default_factory=dict)
    missing: str = ""


def write_evidence(group: h5py.Group, evidence: Evidence) -> None:
    """Store evidence."""
    group.attrs["long_name"] = "beyond the trials: slopes, worst cases, halvings"
    if evidence.missing:
        group.attrs["missing"] = evidence.missing
    if evidence.slopes:
        names = list(next(iter(evidence.slopes.values())))
        table = [[of[name] for name in names] for of in evidence.slopes.values()]
        slopes = group.create_dataset("slopes", data=np.array(table, np.float64))
        slopes.attrs["long_name"] = "slopes[response, contributor] at the nominal, SI"
        write_texts(slopes, "responses", list(evidence.slopes))
        write_texts(slopes, "contributors", names)
    for response, sides in evidence.worst_cases.items():
        for side, case in sides.items():
            place = f"worst_cases/{response}/{side}"
            corner = group.create_dataset(place, data=list(case.deviations.values()))
            write_texts(corner, "contributors", list(case.deviations))
            corner.attrs["value"] = case.value
            corner.attrs["tried"], corner.attrs["failed"] = case.tried, case.failed
    for response, worst in evidence.worst.items():
        of = group.create_group(f"worst/{response}")
        of["trial"] = np.array([each.trial for each in worst], np.int64)
        of["precise"] = np.array([each.precise for each in worst], np.float64)
    for response, shares in evidence.halved.items():
        _write_halved(group, f"halved/{response}", shares)


def _write_halved(
    group: h5py.Group, place: str, shares: Mapping[Members, Halved]
) -> None:
    rows = [(*each.beyond[:3], each.effective) for each in shares.values()]
    table = group.create_dataset(place, data=np.array(rows, np.float64).reshape(-1, 4))
    table.attrs["long_name"] = "share beyond with tolerances halved"
    write_texts(table, "columns", ["share", "lower", "upper", "effective trials"])
    write_texts(table, "halved", [", ".join(members) for members in shares])
    write_texts(table, "reasons", [each.beyond.reason for each in shares.values()])


def read_evidence(group: h5py.Group | None) -> Evidence:
    """Return stored evidence; without any, why there is none."""
    if group is None:
        return Evidence(missing="the run did not come to its end")
    slopes: dict[str, dict[str, float]] = {}
    if "slopes" in group:
        names = texts(group["slopes"], "contributors")
        for response, row in zip(
            texts(group["slopes"], "responses"), group["slopes"][...], strict=True
        ):
            slopes[response] = dict(zip(names, row.tolist(), strict=True))
    cases = {
        response: {side: _case(corner) for side, corner in sides.items()}
        for response, sides in group.get("worst_cases", {}).items()
    }
    worst = {response: _worst(of) for response, of in group.get("worst", {}).items()}
    halved = {name: _halved(table) for name, table in group.get("halved", {}).items()}
    return Evidence(slopes, cases, worst, halved, group.attrs.get("missing", ""))


def _halved(table: h5py.Dataset) -> dict[Members, Halved]:
    rows = zip(
        texts(table, "halved"), table[...].tolist(), texts(table, "reasons"),
        strict=True,
    )  # fmt: skip
    found = {}
    for members, (share, lower, upper, effective), reason in rows:
        beyond = Estimate(share, lower, upper, reason)
        found[tuple(members.split(", "))] = Halved(beyond, int(effective))
    return found


def _case(corner: h5py.Dataset) -> WorstCase:
    attrs = corner.attrs
    machine = dict(
        zip(texts(corner, "contributors"), corner[...].tolist(), strict=True)
    )
    return WorstCase(
        float(attrs["value"]), machine, int(attrs["tried"]), int(attrs["failed"])
    )


def _worst(group: h5py.Group) -> list[Worst]:
    rows = zip(
        group["trial"][...].tolist(), group["precise"][...].tolist(), strict=True
    )
    return [Worst(*row) for row in rows]
