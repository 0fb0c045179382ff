"""Run a study with two workers in a process of its own, and say what it took.

    python -m tests.benchmarks.many 20000

Prints seconds, peak memory and size of the file, in bytes, as JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import tolstat

STUDY = Path(__file__).parents[2] / "runs" / "khpt75.toml"


def main() -> None:
    """Run, print."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "run.h5"
        began = time.perf_counter()
        tolstat.run(STUDY, trials=int(sys.argv[1]), workers=2, output=file)
        seconds = time.perf_counter() - began
        # Linux counts it in KiB
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        size = file.stat().st_size
        print(json.dumps({"seconds": seconds, "memory": memory, "file": size}))


if __name__ == "__main__":
    main()
