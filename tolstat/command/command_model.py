"""A model that runs a command for each trial, in a folder of its own."""

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tolstat.arrays import Array
from tolstat.command.placeholders import JSON, TOML, Command, check_template
from tolstat.errors import ModelError, UnitError
from tolstat.lanes.digest import digest
from tolstat.model.checked import LONGEST_OUTPUT
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response
from tolstat.model.settings import column, setting
from tolstat.operating_system import end_with_parent, signal_name
from tolstat.status import Status
from tolstat.units.conversion import dimension, from_si, si_unit, to_si
from tolstat.units.grammar import Measure

NO_ANSWER = "no answer"
MOST_FOLDERS = 20  # of failed trials that a worker process keeps
LOG = "log.txt"  # output of the command


@dataclass(frozen=True)
class CommandSettings:
    """Inputs and responses of a command."""

    links: dict[str, Any] = setting(
        {"size": {"nominal": Measure(0.02, "m", "mm")}},
        "inputs of the command, in the units that they are written in",
        columns={"nominal": column("its nominal value", like=Measure(0.0, "m"))},
    )
    responses: dict[str, Any] = setting(
        {"force": {"unit": "N"}},
        "units of the numbers that the command writes, by name",
        columns={"unit": column("its unit, in quotes; 1 for none", like="")},
    )


class CommandModel(Model):
    """A command that reads an input file and writes an output file.

    Parameters
    ----------
    command : str
        With {input} and {output}; see `Command`.
    """

    name = "command"
    title = "a command that computes the responses"
    settings = CommandSettings
    isolated = True
    row_by_row = True
    needs_nominal = True
    failures: ClassVar = {NO_ANSWER: "the command writes all responses"}

    def __init__(self, command: str) -> None:
        self._command = Command.read(command)
        self._folders = 0

    @property
    def source_digest(self) -> str:
        """The digest of the command, its files, and of the code that calls it."""
        return digest(super().source_digest, self._command.digest)

    def describe(self, settings: CommandSettings) -> Description:
        """Return the inputs as contributors, and the responses."""
        contributors = []
        for name, row in settings.links.items():
            size: Measure = row["nominal"]
            contributors.append(
                Contributor(name, size.unit, size=size.value, shown=size.shown)
            )
        responses = []
        for name, row in settings.responses.items():
            try:
                unit = si_unit(dimension(row["unit"]))
            except UnitError as error:
                raise ModelError(f"[responses] {name}: {error}") from None
            responses.append(Response(name, unit, shown=row["unit"]))
        if self._command.input_kind not in (JSON, TOML):
            check_template(Path(self._command.input_kind), [*settings.links])
        return Description(tuple(contributors), tuple(responses))

    def evaluate(self, deviations: Array, settings: CommandSettings) -> Outcome:
        """Return the responses that the command writes for each trial."""
        contributors, responses = self.describe(settings)
        numbers = np.full((len(deviations), len(responses)), np.nan)
        status = np.full(len(deviations), Status.DONE.value)
        silent, output = np.zeros(len(deviations), bool), dict[int, str]()
        names = [response.name for response in responses]
        for trial, row in enumerate(deviations):
            folder = Path(tempfile.mkdtemp(prefix="tolstat-trial-"))
            print(f"its folder is {folder}", flush=True)
            self._command.write_input(folder, {
                part.name: from_si((part.size or 0.0) + x, part.unit, part.shown)
                for part, x in zip(contributors, row.tolist(), strict=True)
            })  # fmt: skip
            if code := self._run(folder):
                how = f"exit code {code}" if code > 0 else signal_name(-code)
                output[trial] = self._kept(folder, f"the command ends with {how}")
                status[trial] = Status.CRASHED
                continue
            try:
                values = self._command.read_output(folder, names)
            except ValueError as error:
                output[trial] = self._kept(folder, f"{error}")
                silent[trial] = True
                continue
            shutil.rmtree(folder)
            numbers[trial] = [
                to_si(value, response.shown, response.unit)
                for value, response in zip(values, responses, strict=True)
            ]
            if not np.isfinite(numbers[trial]).all():
                status[trial] = Status.NOT_FINITE
        return Outcome(numbers, status, failed={NO_ANSWER: silent}, output=output)

    def _run(self, folder: Path) -> int:
        """Run the command in a folder; return its exit code."""
        with (folder / LOG).open("wb") as log:
            return subprocess.run(
                self._command.filled(folder),
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                preexec_fn=partial(end_with_parent, os.getpid()),
                check=False,
            ).returncode

    def _kept(self, folder: Path, why: str) -> str:
        """Return why a trial fails, with its folder and the tail of its output."""
        text = (folder / LOG).read_text(errors="replace").strip()
        self._folders += 1
        if self._folders > MOST_FOLDERS:
            shutil.rmtree(folder)
        else:
            why = f"{why}; its folder is {folder}"
        # more is cut from the front, where it says why
        return f"{why}\n{text[-max(LONGEST_OUTPUT - len(why) - 1, 1) :]}"
