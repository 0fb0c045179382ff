"""A plain function of NumPy arrays as a model."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import UnitError, allowed_names
from tolstat.lanes.digest import digest
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Contributor, Description, Response
from tolstat.model.settings import column, setting
from tolstat.units.conversion import dimension, from_si, si_unit, to_si
from tolstat.units.grammar import Measure, measure

DECORATED = '@tolstat.as_model(inputs={"seat": "25 mm"}, outputs={"play": "mm"})'


@dataclass(frozen=True)
class Inputs:
    """Settings of a function: its inputs, as links."""

    links: dict[str, Any] = setting(
        {},
        "inputs of the function; a study gives them in its section [links], with "
        "their tolerances; the others have the size of the decorator",
        columns={"nominal": column("its size", like=Measure(0.0, "m"))},
    )


class FunctionModel(Model):
    """A model whose responses are those of a function; called, it is the function.

    Its inputs are contributors, and the links of a study. See `as_model`.
    """

    settings = Inputs

    def __init__(
        self,
        function: Callable[..., Any],
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
    ) -> None:
        self.function = function
        name = getattr(function, "__name__", type(function).__name__)
        lines = (inspect.getdoc(function) or "").splitlines()
        # of each function, not of the class
        vars(self).update(name=name, title=lines[0] if lines else "")
        if not isinstance(getattr(function, "__code__", None), CodeType):
            raise self.fault("a function is expected, written with def or lambda")
        self.inputs = {name: self._read(name, text) for name, text in inputs.items()}
        for name, unit in outputs.items():
            try:
                dimension(unit)
            except (UnitError, TypeError) as error:
                raise self.fault(f"outputs {name} = {unit!r}: {error}") from None
        self.outputs = dict(outputs)
        if not inputs or not outputs:
            raise self.fault(f"inputs and outputs are needed, as in {DECORATED}")
        arguments = [*inspect.signature(function).parameters]
        for name in (*arguments, *inputs):
            if name not in arguments or name not in inputs:
                raise self.fault(
                    f"{name}: the inputs {', '.join(inputs)} are not the arguments "
                    f"{', '.join(arguments)}"
                )

    def _read(self, name: str, text: str) -> Measure:
        try:
            return measure(text)
        except (UnitError, TypeError, AttributeError):
            raise self.fault(
                f'inputs {name} = {text!r}: a nominal value such as "25 mm" is '
                "expected; a study gives its tolerance"
            ) from None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Return what the function returns."""
        return self.function(*arguments, **named)

    def describe(self, settings: Inputs) -> Description:
        """Return the inputs as contributors and the outputs as responses."""
        return Description(
            tuple(
                Contributor(name, size.unit, size=size.value, shown=size.shown)
                for name, size in self._sizes(settings).items()
            ),
            tuple(
                Response(name, si_unit(dimension(unit)), shown=unit)
                for name, unit in self.outputs.items()
            ),
        )

    def _sizes(self, settings: Inputs) -> dict[str, Measure]:
        """Return the nominal value of each input: of the study, or the decorator."""
        sizes = {name: link["nominal"] for name, link in settings.links.items()}
        for name, size in sizes.items():
            if name not in self.inputs:
                allowed = allowed_names(name, self.inputs)
                raise self.fault(f"no input is called {name}; {allowed}")
            if size.unit != self.inputs[name].unit:
                raise self.fault(
                    f"the input {name} is in {self.inputs[name].shown}, not in "
                    f"{size.shown or size.unit}"
                )
        return {**self.inputs, **sizes}

    def evaluate(self, deviations: Array, settings: Inputs) -> Outcome:
        """Return the outcome of the function, called once with all trials."""
        inputs = {
            name: (size.value + deviations[:, i]) * from_si(1.0, size.unit, typed.shown)
            for i, ((name, size), typed) in enumerate(
                zip(self._sizes(settings).items(), self.inputs.values(), strict=True)
            )
        }
        returned = self.function(**inputs)
        columns = self._columns(returned)
        responses = np.empty((len(deviations), len(columns)))
        units = self.outputs.values()
        for i, (values, unit) in enumerate(zip(columns, units, strict=True)):
            name, is_masked = [*self.outputs][i], np.ma.is_masked(values)
            values = np.asarray(values)
            numbers = "biuf" if unit == "1" else "iuf"  # a truth value has no unit
            if is_masked or values.dtype.kind not in numbers:
                masked = ", not masked ones (NaN is a trial that fails)"
                raise self.fault(
                    f"real numbers are expected of the function for {name}"
                    + (masked if is_masked else f", not {returned!r:.40}")
                )
            if values.shape not in ((), deviations.shape[:1]):
                raise self.fault(
                    f"an array of {len(deviations)} trials is expected of the function "
                    f"for {name}, not one of the shape {values.shape}"
                )
            responses[:, i] = values * to_si(1.0, unit, si_unit(dimension(unit)))
        return Outcome(responses)

    def _columns(self, returned: Any) -> Sequence[Any]:
        """Return what the function returns, one array for each output."""
        names = ", ".join(self.outputs)
        if isinstance(returned, Mapping):
            if {*returned} != {*self.outputs}:
                raise self.fault(f"a dict with the keys {names} is expected")
            return [returned[name] for name in self.outputs]
        several = isinstance(returned, tuple | list)
        columns = list(returned) if several else [returned]
        if len(columns) != len(self.outputs):
            raise self.fault(
                f"{names}: {len(self.outputs)} arrays are expected of the function, "
                f"not {len(columns)}"
            )
        return columns

    @property
    def source_digest(self) -> str:
        """The digest of the function's file; of its code where it has none."""
        code = self.function.__code__
        file = Path(code.co_filename)
        root = file if file.is_file() else _code_words(code)
        declared = f"{self.inputs} {self.outputs}"
        return digest(Path(__file__), root, declared, super().source_digest)


def _code_words(code: CodeType) -> str:
    """Return what code does, its names and inner functions included."""
    constants = [
        _code_words(constant) if isinstance(constant, CodeType) else repr(constant)
        for constant in code.co_consts
    ]
    return f"{code.co_code.hex()} {code.co_names} {constants}"


def as_model(
    *, inputs: Mapping[str, str], outputs: Mapping[str, str]
) -> Callable[[Callable[..., Any]], FunctionModel]:
    """Make a model of a function of NumPy arrays: a decorator.

    Parameters
    ----------
    inputs : mapping of str to str
        Nominal values by argument, such as `{"seat": "25 mm"}`. The function takes
        sizes in these units, float64[trial], and not deviations.
    outputs : mapping of str to str
        Units by response, such as `{"play": "mm"}`. The function returns an array; of
        several responses a tuple of arrays, or a dict.

    Returns
    -------
    callable
        It takes the function and returns the model, which has the function's name.
        Studies and `Chain` give its inputs as links. On the command line it is
        `--machine FILE.py:NAME`. `resume` and `extend` take it as `model`. Other
        processes find it only if it was loaded so from its file.

    Raises
    ------
    ModelError
        If inputs are not the arguments of the function, or a unit is unknown.

    Examples
    --------
    >>> @tolstat.as_model(inputs={"seat": "25 mm", "ring": "24.9 mm"},
    ...                   outputs={"play": "mm"})
    ... def fit(seat, ring):
    ...     return seat - ring
    >>> study = tolstat.Chain(model=fit, trials=1000).link("seat", "25 +-0.03 mm")
    >>> f"{1e3 * study.run().column('play').mean():.2f} mm"
    '0.10 mm'
    """
    return lambda function: FunctionModel(function, inputs, outputs)
