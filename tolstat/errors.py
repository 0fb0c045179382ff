"""Errors of tolstat, and the advice that they give."""

import difflib
import traceback
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from traceback import TracebackException
from typing import Any, NamedTuple

LONGEST_MESSAGE = 1000  # characters of the message of another's error


class Remedy(StrEnum):
    """What to do after an error; commands are named where it is worded."""

    RUN = "run"
    REPAIR = "repair"
    RESUME = "resume"
    DECIDE = "decide"
    DECIDE_REGARDLESS = "decide regardless"
    RESUME_REGARDLESS = "resume regardless"
    RUN_AGAIN = "run again"
    REPLACE = "replace"
    REPLACE_RUN = "replace run"
    EXTEND = "extend"
    EXPORT = "export"
    PLOT = "plot"
    CUSTOM_MODEL = "custom model"


class Advice(NamedTuple):
    """A remedy for an error; the command line prints the command to type."""

    remedy: Remedy
    path: Path = Path()  # the run file, or the study to run
    machine: str = ""  # FILE.py:NAME of a custom model
    # total number of trials, of an extension or of a run that replaces one
    trials: int = 0
    run: Any = None  # the run to repeat or to plot


class TolstatError(Exception):
    """Any error of tolstat; the message is for people.

    Attributes
    ----------
    exit_code : int
        Exit code of the command: 2 for wrong input, 1 for a failure.
    advice : tuple of Advice
        Remedies.
    """

    exit_code = 2

    def __init__(self, message: str = "", *advice: Advice) -> None:
        super().__init__(message)
        self.advice = advice


class UnitError(TolstatError, ValueError):
    """A quantity that cannot be read, or one of the wrong kind."""


class ModelError(TolstatError, ValueError):
    """A model, a setting, a contributor or a response that does not exist or fit.

    Attributes
    ----------
    link : str
        The link of a chain that does not fit its formula; empty for any other error.
    section : str
        The section of a study that is wrong; empty where its settings are.
    """

    link = ""
    section = ""


class DistributionError(TolstatError, ValueError):
    """A distribution that does not exist, or does not fit its tolerance."""


class CostError(TolstatError, ValueError):
    """A cost that cannot be read, or does not fit the tolerance."""


class DataError(TolstatError, ValueError):
    """A data file beside a study that cannot be read."""


class DependenceError(TolstatError, ValueError):
    """Correlations or batches that are impossible."""


class GradeError(TolstatError, ValueError):
    """A tolerance grade that its standard does not define for such a part."""


class StudyError(TolstatError, ValueError):
    """A wrong study; the message lists every problem found."""


class QuestionError(TolstatError):
    """A question that a run cannot answer, or a picture that cannot show it."""


class RunFileError(TolstatError):
    """A run file that exists already, is missing, or cannot be read."""


class BrokenError(RunFileError):
    """A failure on the way, such as a full disk; stored trials are safe."""

    exit_code = 1


class LostError(BrokenError):
    """The workers are lost, such as a cluster; the model is not at fault."""


class FormatError(RunFileError):
    """A run file in a format that this tolstat does not read."""


class DamagedError(RunFileError):
    """A run file whose bytes have changed since it was written."""

    exit_code = 1


class StoppedError(TolstatError):
    """A command was stopped before there was anything to keep."""

    exit_code = 130


def told(error: BaseException) -> str:
    """Return kind and message of an error in code of others, cut where it is long."""
    exception = TracebackException(type(error), error, None)
    exception.__notes__ = []  # they would come last
    words = [*exception.format_exception_only()][-1].strip()
    return words if len(words) <= LONGEST_MESSAGE else f"{words[:LONGEST_MESSAGE]} ..."


def package_that_fails(error: BaseException) -> str:
    """Return the package whose import fails by this error; empty if none does.

    Many read environment variables and files of their own while they are loaded. A
    fault of this package, or of what was called, is none.
    """
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    loading = [f.f_globals for f in frames if f.f_code.co_name == "<module>"]
    names = [module.get("__name__", "").partition(".")[0] for module in loading]
    return names[-1] if names and names[-1] not in ("__main__", "tolstat") else ""


def allowed_names(wrong: str, allowed: Iterable[str]) -> str:
    """Return a hint for a wrong name: the names that are meant, or all allowed ones.

    "did you mean ...?" where the wrong name is another word of the field for an allowed
    one, or else near one; else the list of them. The wrong name is as the user typed
    it.
    """
    from tolstat.synonyms import names_of  # a long table, for mistakes alone

    names = list(allowed)
    similar = names_of(wrong, names) or [
        (name, "") for name in difflib.get_close_matches(wrong, names, n=3, cutoff=0.6)
    ]
    if similar:
        meant = " or ".join(f"'{name}'{more}" for name, more in similar)
        return f"did you mean {meant}?"
    return "allowed: " + (", ".join(names) if names else "none")
