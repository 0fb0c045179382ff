"""Guard around a model's own code: its failures name the model, and harm no other."""

import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import chdir, contextmanager, nullcontext
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

from tolstat.errors import TolstatError, told
from tolstat.model.contract import Model

STREAMS = {"stdout": 1, "stderr": 2}  # of the process, with their descriptors


@contextmanager
def guarded(model: Model, function: str) -> Iterator[None]:
    """Name the model, the fault and its line, where the model's own code fails."""
    streams = {name: getattr(sys, name) for name in STREAMS}
    try:  # a model may leave the working directory, which all threads share
        with chdir(".") if current_thread() is main_thread() else nullcontext():
            yield
    except (TolstatError, KeyboardInterrupt):
        raise
    except BaseException as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise model.fault(
            f"{function} fails: {told(error)} "
            f"({Path(last.filename).name}, line {last.lineno})"
        ) from error
    finally:
        broken = [name for name, stream in streams.items() if _mended(name, stream)]
    if broken:
        raise model.fault(f"{function} closes or breaks sys.{broken[0]}; leave it open")


def _mended(name: str, before: Any) -> bool:
    """Mend a stream of the process that is closed or broken; return whether it was."""
    if not hasattr(before, "write") or _open(getattr(sys, name)):
        return False
    if not _open(before):  # closed, but not its descriptor
        encoding = getattr(before, "encoding", None)
        before = os.fdopen(STREAMS[name], "w", encoding=encoding, closefd=False)
    setattr(sys, name, before)
    return True


def _open(stream: Any) -> bool:
    return hasattr(stream, "write") and not getattr(stream, "closed", False)
