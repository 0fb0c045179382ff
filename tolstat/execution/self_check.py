"""Check of a computer: whether trials repeat bit for bit, versions, compiled code."""

import time
import warnings
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

from tolstat.execution.run_loop import other_results
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.lanes import cache
from tolstat.operating_system import processors
from tolstat.store.provenance import provenance
from tolstat.study.study import load

STUDY = {
    "model": "stand", "trials": 64, "seed": 1, "deviations": {"rod_length": "+-1.2 mm"},
}  # fmt: skip
EXTRAS = {"distributed": "tolstat[cluster]", "pyarrow": "tolstat[parquet]"}
LASTING = 2.0  # s, duration of the check


class Check(NamedTuple):
    """Trials of the stand, evaluated repeatedly."""

    # s, of the first trial: it includes the compilation
    ready: float
    trials: int  # evaluated after the first
    seconds: float  # duration of these
    # whether each trial has the same answer, bit for bit, in any block and on any
    # worker
    same: bool


def repeated_trials() -> Check:
    """Return the check: trials of the stand for two seconds on all processors."""
    study = load(STUDY)
    rows = study.deviations()
    began = time.perf_counter()
    with Workers(1, block=8) as crew:
        crew.simulate(study.model, rows[:1], study.settings)
        ready = time.perf_counter() - began
        first = crew.simulate(study.model, rows, study.settings)
    began, trials, same = time.perf_counter(), 0, True
    with Workers() as crew:
        while (seconds := time.perf_counter() - began) < LASTING:
            again = crew.simulate(study.model, rows, study.settings)
            same &= not other_results(again, first).any()
            trials += len(rows)
    return Check(ready, trials, seconds, same)


def environment() -> dict[str, str]:
    """Return versions, processor and whatever else decides numbers and speed."""
    facts = provenance()
    prefix = "version_"
    environment = {
        name.removeprefix(prefix): fact
        for name, fact in facts.items()
        if name.startswith(prefix)
    }
    for name, extra in EXTRAS.items():
        try:
            environment[name] = version(name)
        except PackageNotFoundError:
            environment[name] = f"not installed: pip install '{extra}'"
    for name in ("platform", "processor", "machine_code"):
        environment[name.replace("_", " ")] = facts[name]
    environment["cores"] = str(processors())
    environment["source"] = load(STUDY).model.source_digest
    environment["compiled code"] = compiled_code()
    return environment


def compiled_code() -> str:
    """Return where compiled code is kept, and its size."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        folder = cache.cache_folder(Path(cache.__file__), "doctor")
    if folder is None:
        return str(caught[-1].message) if caught else "is not kept"
    home = Path(folder).parents[1]
    files = [p for p in home.glob("tolstat-*/**/*.nb[ic]") if p.is_file()]
    sources = len({path.relative_to(home).parts[0] for path in files})
    size = sum(path.stat().st_size for path in files)
    return f"{home}: {len(files)} files, {size / 1e6:.1f} MB, of {sources} sources"
