"""What a run file says of the run as a whole: attributes of the root, and groups."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from tolstat.model.description import StudyNumber
from tolstat.store.attributes import texts, write_texts
from tolstat.store.layout import NUMBERS, REFERENCE, SETTINGS, allocate
from tolstat.store.plan import Chosen, Plan, Reference, Sampled, Stopped
from tolstat.store.run_columns import SHOWN

RARE = "rare"  # attribute: the response that it is about


def write_facts(
    file: h5py.File, plan: Plan, path: Path, stopped: Stopped | None
) -> None:
    """Store what is known of the run as a whole, whose file will have this path."""
    attrs = file.attrs
    attrs["study"] = plan.study_text
    if plan.study_file:  # from here: both may be moved together
        attrs["study_file"] = os.path.relpath(plan.study_file, path.parent)
    for name in ("title", "model", "sampling", "source_digest", "machine"):
        attrs[name] = getattr(plan, name)
    contributors, responses = plan.description
    # the order of the columns: HDF5 lists names by alphabet
    write_texts(file, "contributors", [each.name for each in contributors])
    write_texts(file, "responses", [each.name for each in responses])
    for name in ("grid", "notes", "assumptions"):
        write_texts(file, name, getattr(plan, name))
    if plan.sampled:
        attrs["seed"], attrs["promise"] = plan.sampled.seed, plan.sampled.promise
        attrs["replicates"] = plan.sampled.replicates
        attrs["group"] = plan.sampled.group
        write_texts(file, "factors", plan.sampled.factors)
    if plan.rare:
        attrs[RARE] = plan.rare
    write_texts(file, "until", plan.rules)
    if stopped:
        attrs["until_reached"], attrs["until_stages"] = stopped.reached, stopped.stages
        attrs["at_most"], attrs["until_wanted"] = stopped.at_most, stopped.wanted


def study_file_of(path: Path, file: h5py.File) -> Path | None:
    """Say where the study lies that a run was made from."""
    if "study_file" not in file.attrs:
        return None
    return Path(os.path.normpath(path.resolve().parent / file.attrs["study_file"]))


def sampled_of(file: h5py.File) -> Sampled | None:
    """Read how the machines were drawn; None where they were chosen."""
    attrs = file.attrs
    if "seed" not in attrs:
        return None
    numbers = int(attrs["replicates"]), int(attrs["group"])
    factors = texts(file, "factors")
    return Sampled(int(attrs["seed"]), str(attrs["promise"]), *numbers, factors)


def stopped_of(file: h5py.File) -> Stopped | None:
    """Read what the stopping rule made of a run; None where it has not ended so."""
    attrs = file.attrs
    if "until_stages" not in attrs:
        return None
    stages = tuple(attrs["until_stages"].tolist())
    reached, at_most = bool(attrs["until_reached"]), int(attrs["at_most"])
    wanted = float(attrs.get("until_wanted", 0.0))
    return Stopped(texts(file, "until"), reached, stages, at_most, wanted)


def write_settings(file: h5py.File, settings: Mapping[str, Chosen]) -> None:
    """Store settings as they are written."""
    group = file.create_group(SETTINGS, track_order=True)
    group.attrs["long_name"] = "settings of the machine, as the study writes them"
    for name, chosen in settings.items():
        group[name] = chosen.words
        group[name].attrs["long_name"] = chosen.sentence
        group[name].attrs["given"] = chosen.given


def settings_of(file: h5py.File) -> dict[str, Chosen]:
    """Read settings as they are written."""
    return {
        name: Chosen(
            item.asstr()[()], str(item.attrs["long_name"]), bool(item.attrs["given"])
        )
        for name, item in file[SETTINGS].items()
    }


def write_numbers(file: h5py.File, numbers: tuple[StudyNumber, ...]) -> None:
    """Store numbers of the study, where there are any."""
    if not numbers:
        return
    group = file.create_group(NUMBERS, track_order=True)
    group.attrs["long_name"] = "numbers of the study, alike for all its machines"
    for number in numbers:
        alone = allocate(group, number.name, (), np.float64)
        alone[...] = number.value
        alone.attrs["units"], alone.attrs["long_name"] = number.unit, number.sentence
        alone.attrs[SHOWN], alone.attrs["of"] = number.shown, number.of
        alone.attrs["caveat"] = number.caveat


def numbers_of(file: h5py.File) -> tuple[StudyNumber, ...]:
    """Read numbers of the study."""
    found = []
    for name, item in file.get(NUMBERS, {}).items():
        words = (item.attrs[key] for key in ("long_name", SHOWN, "of", "caveat"))
        number = StudyNumber(name, item.attrs["units"], float(item[()]), *words)
        found.append(number)
    return tuple(found)


def write_reference(file: h5py.File, reference: Reference | None) -> None:
    """Store known points, where there are any."""
    if not reference:
        return
    group = file.create_group(REFERENCE, track_order=True)
    group.attrs["label"] = reference.label
    for name, values in reference.columns.items():
        group[name] = values


def reference_of(file: h5py.File) -> Reference | None:
    """Read known points; None where there are none."""
    if REFERENCE not in file:
        return None
    columns = {name: item[...] for name, item in file[REFERENCE].items()}
    return Reference(str(file[REFERENCE].attrs["label"]), columns)
