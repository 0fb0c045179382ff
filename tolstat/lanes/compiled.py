"""Compilation in tolstat: cached by source, without the GIL."""

import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit
from numba.core.errors import NumbaError

from tolstat.lanes.cache import cache_folder, intact, settings_of_numba
from tolstat.lanes.digest import PACKAGE

Function = TypeVar("Function", bound=Callable[..., Any])

# never "nnan" or "ninf": a trial that diverges must be detected
FASTMATH = {"contract", "nsz", "arcp"}


def compiled(
    signature: Any = None, *, within: bool = False
) -> Callable[[Function], Any]:
    """Compile a function to machine code with Numba.

    Parameters
    ----------
    signature : optional
        Numba signature. With one, the function is compiled at once and its machine code
        is kept between sessions. Without one, it is compiled into its callers.
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
        of_tolstat = source.is_relative_to(PACKAGE)
        # tolstat's functions create no arrays: reference counting took a quarter of
        # the time of `march`, one locked instruction for each slice
        options["_nrt"] = not of_tolstat
        if signature is None:
            # they also need no entry from Python: unpacking arguments is most of the
            # code, and a call would crash
            return njit(
                no_cpython_wrapper=of_tolstat, no_cfunc_wrapper=of_tolstat, **options
            )(function)
        typed_in = not source.is_file()  # at a prompt: without a file to digest
        folder = None if typed_in else cache_folder(source, function.__module__)
        with settings_of_numba(folder):
            if folder is None:
                return njit(signature, **options)(function)
            try:
                with intact(folder) as damaged:
                    machine_code = njit(signature, cache=True, **options)(function)
            except NumbaError:
                raise
            except Exception as error:  # files in the folder cannot be read or written
                damaged = [str(error) or type(error).__name__]
                shutil.rmtree(folder, ignore_errors=True)
                machine_code = njit(signature, **options)(function)
        if damaged:
            warnings.warn(
                f"compiled code in {folder} is damaged ({', '.join(damaged)}): "
                "compiled again",
                RuntimeWarning,
                stacklevel=2,
            )
        return machine_code

    return decorate
