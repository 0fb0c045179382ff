"""Blocks sent to other processes: models go by name, and their source is compared."""

import io
import os
import pickle
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tolstat import catalogue
from tolstat.errors import Advice, ModelError, Remedy, TolstatError
from tolstat.model.contract import Model
from tolstat.store.provenance import decisive

_loading = threading.Lock()
_loaded: dict[str, Model] = {}  # custom models of this process, by FILE.py:NAME


class Parcel(NamedTuple):
    """A call for another process, and the versions that it needs there."""

    content: bytes  # the function and its arguments, pickled
    # what decides the bits of the numbers: processor, compiler, versions
    decisive: dict[str, str]


class Mismatch(NamedTuple):
    """A process whose numbers could differ in bits; it has evaluated nothing."""

    who: str  # its name
    reasons: tuple[str, ...]  # what differs there


class _Packer(pickle.Pickler):
    """Models go by name, file and digest of their source."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, Model):
            place = _place_of(obj)
            _loaded[place] = obj  # threads of this process have it already
            return _found, (obj.name, place, obj.source_digest)
        return NotImplemented


def packed(call: Callable[[], Any]) -> Parcel:
    """Pack a call for another process."""
    buffer = io.BytesIO()
    _Packer(buffer, pickle.HIGHEST_PROTOCOL).dump(call)
    return Parcel(buffer.getvalue(), decisive())


def carried_out(parcel: Parcel) -> Any:
    """Return the result of a call made here; a `Mismatch` if bits could differ."""
    here = decisive()
    reasons = [
        f"its {what} is {here.get(what, 'unknown')}, the run needs {value}"
        for what, value in parcel.decisive.items()
        if here.get(what) != value
    ]
    try:
        call = pickle.loads(parcel.content)
    except TolstatError as error:
        reasons.append(str(error))
    if reasons:
        return Mismatch(f"{socket.gethostname()}, process {os.getpid()}", (*reasons,))
    return call()


def _place_of(model: Model) -> str:
    """Return where others find a model: FILE.py:NAME, empty for an installed one."""
    place = catalogue.place_of(model)
    if place == catalogue.ANY:
        raise ModelError(
            f"model '{model.name}' is an object of this process, so other processes "
            "cannot find it; load it from its file (tolstat.catalogue.load)",
            Advice(Remedy.CUSTOM_MODEL),
        )
    file, _, name = place.rpartition(":")
    return f"{Path(file).resolve()}:{name}" if place else ""


def _found(name: str, place: str, digest: str) -> Model:
    """Return a model by its name; refuse another source."""
    with _loading:  # of two threads one loads it
        if place and place not in _loaded:
            _loaded[place] = catalogue.load(place)
        model = _loaded[place] if place else catalogue.find(name)
    if model.source_digest != digest:
        raise ModelError(
            f"its source of model '{name}' is {model.source_digest}, the run "
            f"needs {digest}"
        )
    return model
