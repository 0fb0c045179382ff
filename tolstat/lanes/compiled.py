"""Compilation the way tolstat does it: cached by source, without the GIL."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import njit
from numba.core.errors import NumbaError

from tolstat.lanes.cache import cache_folder, intact
from tolstat.lanes.digest import PACKAGE

Function = TypeVar("Function", bound=Callable[..., Any])

# never "nnan" or "ninf": a trial that blows up must be seen
FASTMATH = {"contract", "nsz", "arcp"}
# LLVM's third level finds nothing more in equations, and takes a tenth longer; the
# number is one of Numba's own kind
LEVEL = type(numba.config.OPT)(2)


def compiled(
    signature: Any = None, *, within: bool = False
) -> Callable[[Function], Any]:
    """Compile a function to machine code with Numba.

    Parameters
    ----------
    signature : optional
        Numba signature; with one the function is compiled at once and its machine code
        kept between sessions, without one it is compiled into whatever calls it.
    within : bool
        Compile the function into its caller, leaving no call: for equations.

    Returns
    -------
    callable
        The decorator.
    """
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": FASTMATH,
        "forceinline": within,
    }

    def decorate(function: Function) -> Any:
        source = Path(function.__code__.co_filename)
        own = source.is_relative_to(PACKAGE)
        # tolstat's own make no arrays: counting who refers to those of the march took a
        # quarter of its time, one locked instruction for each slice
        options["_nrt"] = not own
        if signature is None:
            # nor do they need a way in from Python: unpacking arguments is most of
            # the code, and whoever called would crash
            return njit(no_cpython_wrapper=own, no_cfunc_wrapper=own, **options)(
                function
            )
        typed_in = not source.is_file()  # at a prompt: there is nothing to go by
        folder = None if typed_in else cache_folder(source, function.__module__)
        before = numba.config.CACHE_DIR, numba.config.OPT
        try:
            # global to every user of Numba in the process: put back at once
            numba.config.CACHE_DIR = folder or before[0]
            numba.config.OPT = min(LEVEL, before[1])
            if folder is None:
                return njit(signature, **options)(function)
            try:
                with intact(folder) as damaged:
                    made = njit(signature, cache=True, **options)(function)
            except NumbaError:
                raise
            except Exception as error:  # what is kept there cannot be read, or written
                damaged = [str(error) or type(error).__name__]
                shutil.rmtree(folder, ignore_errors=True)
                made = njit(signature, **options)(function)
            if damaged:
                warnings.warn(
                    f"compiled code in {folder} is damaged ({', '.join(damaged)}): "
                    "compiled again",
                    RuntimeWarning,
                    stacklevel=2,
                )
            return made
        finally:
            numba.config.CACHE_DIR, numba.config.OPT = before

    return decorate
