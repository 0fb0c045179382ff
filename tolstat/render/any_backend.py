"""Matplotlib, loaded although it may refuse the user's backend: none is needed here.

Pictures go to files alone. A backend that matplotlib knows stays the user's.
"""

import os
import sys
from contextlib import suppress

backend = os.environ.get("MPLBACKEND")
if backend and "matplotlib" not in sys.modules:
    del os.environ["MPLBACKEND"]
    import matplotlib as mpl

    os.environ["MPLBACKEND"] = backend
    with suppress(ValueError):
        mpl.rcParams["backend"] = backend
