"""Blocks sent to other processes: machines go by name, and their source is compared."""

from __future__ import annotations

import io
import os
import pickle
import socket
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from tolstat import catalogue
from tolstat.errors import ModelError, TolstatError
from tolstat.model.contract import Model
from tolstat.store.provenance import decisive

_loading = threading.Lock()


class Origin(NamedTuple):
    """Where a machine comes from."""

    name: str  # of the catalogue
    place: str  # FILE.py:NAME of a machine of one's own; empty for an installed one
    digest: str  # of the source that decides its numbers


class Parcel(NamedTuple):
    """A call that another process can make, and what has to be the same there."""

    content: bytes  # the function and its arguments
    origins: tuple[Origin, ...]  # the machines in it
    # what decides the bits of the numbers: processor, versions
    decisive: dict[str, str]


class Otherwise(NamedTuple):
    """A process that would come to other bits, and has evaluated nothing."""

    who: str  # its name
    reasons: tuple[str, ...]  # what is different there


class _Packer(pickle.Pickler):
    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self.origins: dict[Origin, None] = {}

    def persistent_id(self, obj: Any) -> Origin | None:
        if not isinstance(obj, Model):
            return None
        origin = _origin_of(obj)
        self.origins[origin] = None
        return origin


class _Unpacker(pickle.Unpickler):
    def persistent_load(self, pid: Any) -> Model:
        return _machine(pid.name, pid.place)


def packed(call: Callable[[], Any]) -> Parcel:
    """Pack a call for another process."""
    buffer = io.BytesIO()
    packer = _Packer(buffer)
    packer.dump(call)
    return Parcel(buffer.getvalue(), tuple(packer.origins), decisive())


def carried_out(parcel: Parcel) -> Any:
    """Make a call here; an `Otherwise` if it could come to other bits than at home."""
    here = decisive()
    reasons = [
        f"its {what} is {here.get(what, 'unknown')}, and {value} is asked for"
        for what, value in parcel.decisive.items()
        if here.get(what) != value
    ]
    for name, place, digest in parcel.origins:
        try:
            found = _machine(name, place).source_digest
        except TolstatError as error:
            reasons.append(str(error))
            continue
        if found != digest:
            reasons.append(
                f"its source of the machine '{name}' is {found}, and {digest} is asked "
                "for"
            )
    if reasons:
        return Otherwise(f"{socket.gethostname()}, process {os.getpid()}", (*reasons,))
    return _Unpacker(io.BytesIO(parcel.content)).load()()


def _origin_of(model: Model) -> Origin:
    """Say where others find a machine."""
    place = catalogue.place_of(model)
    if place == catalogue.ANY:
        raise ModelError(
            f"the machine '{model.name}' is an object of this process, and others "
            "cannot find it: name its file, --machine FILE.py:NAME "
            "(tolstat.catalogue.load)"
        )
    if place:
        file, _, name = place.rpartition(":")
        place = f"{Path(file).resolve()}:{name}"
    return Origin(model.name, place, model.source_digest)


def _machine(name: str, place: str) -> Model:
    """Find a machine here."""
    with _loading:  # of two threads one loads it
        return _loaded(place) if place else catalogue.find(name)


_loaded = cache(catalogue.load)
