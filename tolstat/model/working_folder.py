"""The working directory, which all threads share and a model may change."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def kept_folder() -> Iterator[None]:
    """Return to the working directory at the end."""
    here = ""
    with suppress(OSError):  # it may have been removed
        here = os.getcwd()
    try:
        yield
    finally:
        with suppress(OSError):
            os.chdir(here)
