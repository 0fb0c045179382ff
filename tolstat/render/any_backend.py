"""Matplotlib, loaded although it may refuse the user's backend: none is needed here.

Pictures go to files alone. A backend that matplotlib knows stays the user's.
"""

import os
import sys
from contextlib import suppress

given = os.environ.get("MPLBACKEND")
if given and "matplotlib" not in sys.modules:
    del os.environ["MPLBACKEND"]
    import matplotlib as mpl

    os.environ["MPLBACKEND"] = given
    with suppress(ValueError):
        mpl.rcParams["backend"] = given
