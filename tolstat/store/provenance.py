"""Provenance of a run: versions, processor, time."""

import platform
import sys
import time
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version

import h5py

from tolstat.lanes.cache import machine_code
from tolstat.operating_system import local_time

PACKAGES = ("tolstat", "numba", "llvmlite", "numpy", "scipy", "pandas", "h5py")
# what decides the bits of a trial, by the name of the fact in the provenance of a run
DECISIVE = {
    **{f"version_{name}": name for name in PACKAGES[1:5]},
    "processor": "processor",
    "machine_code": "machine code",
}


def now() -> str:
    """Return the time, with its zone."""
    return local_time(time.time())


def processor() -> str:
    """Name the processor and the instruction set that the lanes are compiled to."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    vectors = [
        name for name in ("avx512f", "avx2", "neon", "sse2") if features.get(name)
    ]
    return f"{platform.machine()} {binding.get_host_cpu_name()} {' '.join(vectors[:1])}"


@cache
def provenance() -> dict[str, str]:
    """Return the versions of everything that decides the numbers."""
    return {
        **{f"version_{name}": version(name) for name in PACKAGES},
        "version_python": platform.python_version(),
        "version_hdf5": h5py.version.hdf5_version,
        "processor": processor(),
        "machine_code": machine_code(),
        "platform": platform.platform(),
        "command": " ".join(sys.argv[1:]) if sys.argv else "",
    }


def decisive(facts: Mapping[str, str]) -> dict[str, str]:
    """Return versions, processor and compiler, which decide the bits of a trial.

    Older runs do not know all of them.
    """
    return {word: facts[name] for name, word in DECISIVE.items() if name in facts}
