"""The number of threads of BLAS changes no bit of deviations and responses."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile

import tolstat

LINKS = 24  # of so many columns and 5000 rows BLAS makes a product in several threads
NAMES = [f"L{i}" for i in range(LINKS)]
STUDY = {
    "model": "dimension_chain", "sampling": "rare", "trials": 5000, "seed": 3,
    "settings": {"gap": " + ".join(NAMES)},
    "links": {n: {"nominal": "10 mm", "tolerance": "+-0.3 mm"} for n in NAMES},
    "correlation": {"L0": {"L1": 0.5}, "L1": {"L2": 0.3}},
    "limits": {"gap": f"<= {10 * LINKS + 2.4} mm"},
}  # fmt: skip


def digest():
    """Return a digest of all columns of a rare run, of the stages too."""
    found = hashlib.sha256()
    with tempfile.TemporaryDirectory() as folder:
        run = tolstat.run(STUDY, output=f"{folder}/run.h5")
        for name in (*run.input_names, "gap"):
            found.update(run.column(name).tobytes())
    return found.hexdigest()


def test_two_threads_of_blas_give_the_bits_of_one():
    """Tests run with one."""
    command = "from tests.execution.test_blas_threads import digest; print(digest())"
    threads = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    with subprocess.Popen(
        [sys.executable, "-c", command], env=threads, stdout=subprocess.PIPE, text=True
    ) as other:
        of_one = digest()
        assert other.communicate()[0].split() == [of_one]
