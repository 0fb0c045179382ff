"""Trials evaluated again, why these, and how they lie in the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.model.description import Response
from tolstat.store.attributes import texts, write_texts

# no response can be called so: these cannot be typed as a name
AT_RANDOM, CHOSEN_BY = "chosen-at-random", "chosen-by"


class Reason(IntFlag):
    """Why a response had a trial evaluated again; there may be several reasons."""

    NEAR = 1  # next to an end of its limit, or so near that an error may cross it
    WORST = 2  # nearest to the limit from within, or farthest beyond
    SPREAD = 4  # one of those spread over its range, the least and the largest included


@dataclass(frozen=True)
class Audited:
    """Trials that were evaluated again, more precisely.

    Attributes
    ----------
    trials : int64[n]
        Their numbers, ascending.
    settings : dict of str to float
        What was tightened, and to what: rtol.
    status : uint8[n]
        How they ended then.
    responses : dict of str to float64[n]
        SI.
    at_random : bool[n]
        Whether a trial is the one of its hundred that was chosen at random: only these
        speak for the machines that were not evaluated again.
    chosen_by : dict of str to uint8[n]
        By response that chose trials on purpose: sums of `Reason`, 0 for none.
    """

    trials: NDArray[np.int64]
    settings: Mapping[str, float]
    status: NDArray[np.uint8]
    responses: Mapping[str, NDArray[np.float64]]
    at_random: NDArray[np.bool_]
    chosen_by: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)


def joined(one: Audited, other: Audited) -> Audited:
    """Put other trials, evaluated with the same settings, among those of one."""
    trials = np.concatenate([one.trials, other.trials])
    order = np.argsort(trials)
    return Audited(
        trials[order],
        one.settings,
        np.concatenate([one.status, other.status])[order],
        _together(one.responses, other.responses, order),
        np.concatenate([one.at_random, other.at_random])[order],
        _together(one.chosen_by, other.chosen_by, order),
    )


def _together(
    one: Mapping[str, NDArray[Any]],
    other: Mapping[str, NDArray[Any]],
    order: NDArray[np.int64],
) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([one[name], other[name]])[order] for name in one}


def write_audited(
    group: h5py.Group, audited: Audited, responses: tuple[Response, ...]
) -> None:
    """Store trials that were evaluated again."""
    group.attrs["long_name"] = "trials evaluated again, more precisely"
    for name, value in audited.settings.items():
        group.attrs[name] = value
    write_texts(group, "tightened", list(audited.settings))
    group["trial"], group["status"] = audited.trials, audited.status
    for response in responses:
        group[response.name] = audited.responses[response.name]
        group[response.name].attrs["units"] = response.unit
    group[AT_RANDOM] = audited.at_random.astype(np.uint8)
    group[AT_RANDOM].attrs["long_name"] = "the one of each hundred chosen at random"
    chosen_by = group.create_group(CHOSEN_BY)
    chosen_by.attrs["long_name"] = "why a response had a trial evaluated again"
    for name, reasons in audited.chosen_by.items():
        chosen_by[name] = reasons
        # as the CF conventions have it
        attrs = chosen_by[name].attrs
        attrs["flag_masks"] = np.array([reason.value for reason in Reason], np.uint8)
        attrs["flag_meanings"] = " ".join(str(r.name).lower() for r in Reason)


def read_audited(
    group: h5py.Group | None, responses: tuple[Response, ...]
) -> Audited | None:
    """Return stored trials that were evaluated again; None without any."""
    if group is None:
        return None
    trials = group["trial"][...]
    at_random = np.ones(len(trials), bool)  # all were, before any was chosen on purpose
    if AT_RANDOM in group:
        at_random = group[AT_RANDOM][...].astype(bool)
    return Audited(
        trials,
        {name: float(group.attrs[name]) for name in texts(group, "tightened")},
        group["status"][...],
        {each.name: group[each.name][...] for each in responses},
        at_random,
        {name: item[...] for name, item in group.get(CHOSEN_BY, {}).items()},
    )
