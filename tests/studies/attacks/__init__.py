"""Attacks on files and disks, run by hand: see the README."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy loads: processes are forked
