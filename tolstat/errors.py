"""What tolstat says to an engineer when it refuses to go on."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple


class Advice(NamedTuple):
    """What can be done about an error; the command line says what is typed for it.

    Attributes
    ----------
    what : str
        "run", "repair", "resume", "resume regardless", "run again", "replace",
        "replace run", "extend", "export", "plot", "report", "custom model".
    path : Path
        Of a run, or of a study that is run.
    machine : str
        Where a custom model is.
    trials : int
        In all, of an extension or of a run that replaces one.
    run : object
        What is run again.
    """

    what: str
    path: Path = Path()
    machine: str = ""
    trials: int = 0
    run: Any = None


class TolstatError(Exception):
    """Anything that tolstat refuses; the message is meant to be read by people.

    Attributes
    ----------
    exit_code : int
        Of a command that ends so: 2 where something asked for is wrong, 1 where
        something broke.
    advice : tuple of Advice
        What can be done about it.
    """

    exit_code = 2

    def __init__(self, message: str = "", *advice: Advice) -> None:
        super().__init__(message)
        self.advice = advice


class UnitError(TolstatError, ValueError):
    """A quantity that cannot be read, or one of the wrong kind."""


class ModelError(TolstatError, ValueError):
    """A model, a setting, a contributor or a response that does not exist or fit."""


class DistributionError(TolstatError, ValueError):
    """A distribution that does not exist, or does not fit its tolerance."""


class CostError(TolstatError, ValueError):
    """A cost that cannot be read, or does not fit the tolerance."""


class DataError(TolstatError, ValueError):
    """A data file beside a study that cannot be read."""


class DependenceError(TolstatError, ValueError):
    """Correlations or batches that cannot be."""


class GradeError(TolstatError, ValueError):
    """A tolerance grade that its standard does not have, or not for such a part."""


class StudyError(TolstatError, ValueError):
    """A study that is wrong; every problem found in it stands in the message."""


class PictureError(TolstatError):
    """A picture that cannot be drawn of this, or cannot be written there."""


class RunFileError(TolstatError):
    """A run file that exists already, is missing, or cannot be read."""


class BrokenError(RunFileError):
    """Something broke on the way, a full disk: what was stored before is safe."""

    exit_code = 1


class LostError(BrokenError):
    """Whoever evaluates is lost, a cluster: the machine is sound."""


class FormatError(RunFileError):
    """A run file of another format than this tolstat reads."""


class DamagedError(RunFileError):
    """A run file whose bytes are not those that were written."""

    exit_code = 1


class StoppedError(TolstatError):
    """Stopped before there was anything to be kept."""

    exit_code = 130


def allowed_names(wrong: str, allowed: Iterable[str]) -> str:
    """Say what is allowed instead of a wrong name, the nearest known one first.

    Parameters
    ----------
    wrong : str
        The name as the user typed it.
    allowed : iterable of str
        Every name that would have been right.

    Returns
    -------
    str
        "did you mean ...?" where a known name is near, else the list of them.
    """
    names = list(allowed)
    near = difflib.get_close_matches(wrong, names, n=3, cutoff=0.6)
    if near:
        return "did you mean " + " or ".join(f"'{name}'" for name in near) + "?"
    return "allowed: " + (", ".join(names) if names else "none")
