"""A model that crashes, hangs, leaks or ends its process in some trials."""

from __future__ import annotations

import ctypes
import os
import sys
import time
from dataclasses import dataclass

from tolstat import Contributor, Description, Model, Outcome, Response, setting

ABOVE = 2.0  # sigma of the deviation
HOWS = ("fine", "crash", "exit", "abort", "hang", "leak", "kill", "sys.exit", "error")


@dataclass(frozen=True)
class TroubleSettings:
    how: str = setting("fine", "what trials above two sigma do", choices=HOWS)


class Trouble(Model):
    """Blocks of rows at once: the guilty row has to be found."""

    name = "trouble"
    settings = TroubleSettings
    isolated = True

    def describe(self, settings):
        return Description((Contributor("x", "m"),), (Response("y", "m"),))

    def evaluate(self, deviations, settings):
        if (deviations > ABOVE).any() and settings.how != "fine":
            print("about to", settings.how)
            do(settings.how)
        return Outcome(2 * deviations + 1)


class RowByRow(Trouble):
    """One row at a time: the guilty row is known."""

    name = "trouble_by_row"
    row_by_row = True

    def evaluate(self, deviations, settings):
        assert len(deviations) == 1
        return super().evaluate(deviations, settings)


def do(how):
    """Be in trouble."""
    match how:
        case "crash":
            ctypes.string_at(0)
        case "exit":
            os._exit(0)
        case "abort":
            os.abort()
        case "kill":
            os.kill(os.getpid(), 9)
        case "hang":
            time.sleep(1e6)
        case "leak":
            rows = []
            while True:
                rows.append(b"x" * (1 << 24))
        case "error":
            raise ValueError(how)
        case _:
            sys.exit(3)
