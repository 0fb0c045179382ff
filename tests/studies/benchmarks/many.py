"""Run a study with two workers in a separate process, and print its time.

    python -m tests.studies.benchmarks.many 20000

Prints seconds, peak memory and size of the file, in bytes, as JSON.
"""

from __future__ import annotations

import json
import re
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import tolstat

STUDY = Path(__file__).parents[3] / "runs" / "khpt75.toml"


def peak_memory() -> int:
    """Return it in bytes; Linux's ru_maxrss counts the process that started this."""
    told = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return int(told[1]) * 1024 if told else 0


def main() -> None:
    """Run, print."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "run.h5"
        began = time.perf_counter()
        tolstat.run(STUDY, trials=int(sys.argv[1]), workers=2, output=file)
        seconds = time.perf_counter() - began
        memory = peak_memory()
        size = file.stat().st_size
        print(json.dumps({"seconds": seconds, "memory": memory, "file": size}))


if __name__ == "__main__":
    main()
