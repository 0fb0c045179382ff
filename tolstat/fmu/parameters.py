"""What a study may set of an FMU: its parameters and inputs, each as a setting.

Real ones are contributors, too. Names are those of the FMU, spelled so that a study can
type them: `damper.d` is `damper_d`, `x[1]` is `x_1`.
"""

import keyword
import math
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

from tolstat.errors import ModelError
from tolstat.fmu.base_units import PLAIN, FmuUnit, unit_of_variable
from tolstat.fmu.model_xml import TRUE, FmuFile, Variable
from tolstat.model.settings import setting
from tolstat.units.grammar import MOST_NUMBER


@dataclass(frozen=True, kw_only=True, eq=False)
class Quantity:
    """A variable of an FMU under the name that a study types."""

    name: str
    variable: Variable
    unit: FmuUnit
    start: Any = None  # start value: SI, a word, true or false; None without

    @property
    def sentence(self) -> str:
        """Its description, and its name in the FMU where that is another."""
        exported = "" if self.variable.name == self.name else self.variable.name
        words = self.unit.named_in(self.variable.sentence)
        return f"{words} ({exported})" if words and exported else words or exported

    def setting(self) -> Any:
        """Return its declaration as a setting."""
        kind = "an input" if self.variable.causality == "input" else "a parameter"
        words = self.sentence or f"{kind} of the FMU"
        group = "parameters and inputs of the FMU"
        if not (self.variable.real or self.variable.is_whole):
            choices = [*self.variable.items]
            return setting(self.start, words, choices=choices, group=group)
        least, most = self.bounds
        return setting(
            self.start,
            words,
            unit="" if self.unit.si == "1" else self.unit.si,
            at_least=None if least == -math.inf else least,
            at_most=None if most == math.inf else most,
            group=group,
        )

    @property
    def bounds(self) -> tuple[float, float]:
        """Its least and largest value, SI; none that its start value is beyond."""
        ends = self.variable.least, self.variable.most
        least, most = sorted(map(self.unit.to_si, ends))
        return (
            least if self.start >= least else -math.inf,
            most if self.start <= most else math.inf,
        )

    def to_fmu(self, value: Any) -> Any:
        """Return a value as the FMU takes it."""
        if self.variable.type == "Enumeration":
            return self.variable.items[value]
        return self.unit.from_si(value) if self.variable.real else value


def quantities(
    file: FmuFile, reserved: Iterable[str]
) -> tuple[dict[str, Quantity], dict[str, Quantity]]:
    """Return what a study may set, and the outputs, by name; none is a reserved name.

    Raises
    ------
    ModelError
        If a start value cannot be read.
    """
    used = {*reserved}
    settable, outputs = dict[str, Quantity](), dict[str, Quantity]()
    for variable in file.variables:
        is_output = variable.causality == "output" and variable.numeric
        if variable.array or not (variable.varied or is_output):
            continue
        unit = unit_of(variable, file)
        start = None if is_output else _start(variable, unit, file)
        if not is_output and start is None:
            continue
        name = typed_name(variable.name, used)
        used.add(name)
        quantity = Quantity(name=name, variable=variable, unit=unit, start=start)
        (outputs if is_output else settable)[name] = quantity
    return settable, outputs


def unit_of(variable: Variable, file: FmuFile) -> FmuUnit:
    """Return the unit of a variable."""
    if not variable.real:
        return PLAIN
    return unit_of_variable(variable.unit, variable.display, file.units)


def _start(variable: Variable, unit: FmuUnit, file: FmuFile) -> Any:
    """Return the start value; None where a study could not type it."""
    text = variable.start or ""
    try:
        if variable.real:
            value = unit.to_si(float(text))
            return value if abs(value) <= MOST_NUMBER else None
        if variable.is_whole:
            return int(text)
    except ValueError:
        raise ModelError(
            f"{file.path}: the start value of {variable.name} is '{text}', not a number"
        ) from None
    if variable.type == "Boolean":
        return text in TRUE
    if variable.type == "Enumeration":
        items = {number: item for item, number in variable.items.items()}
        return items.get(int(text))
    return text if variable.type == "String" else None


def typed_name(text: str, used: Collection[str]) -> str:
    """Return a name that can be typed and is not used yet."""
    name = re.sub(r"\W+", "_", text).strip("_") or "x"
    if not name.isidentifier():
        name = f"x{name}"
    if keyword.iskeyword(name) or name in used:
        name = f"{name}_parameter"
    name, number = (stem := name), 2
    while name in used:
        name, number = f"{stem}_{number}", number + 1
    return name
