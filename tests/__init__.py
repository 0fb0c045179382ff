"""Tests of tolstat; one for each room, and of its pages."""

import os

# a worker has one core: more threads of BLAS wait for each other, and busily
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
