"""Settings of a model: declarations, and checked values."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from tolstat.errors import ModelError, allowed_names
from tolstat.model import setting_kinds as kinds
from tolstat.model.contract import Model
from tolstat.units.conversion import check_si
from tolstat.units.grammar import Measure, Range


@dataclasses.dataclass(frozen=True)
class Setting:
    """The declaration of a setting."""

    name: str
    default: Any  # SI, where the study says nothing
    sentence: str
    kind: kinds.Kind
    group: str  # heading above it and the settings after it; empty without one


def setting(
    default: Any,
    sentence: str,
    *,
    unit: str = "",
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    choices: Sequence[str] = (),
    presets: Mapping[str, float | None] | None = None,
    count: tuple[int, int] = (1, 10_000),
    columns: Mapping[str, kinds.Column] | None = None,
    group: str = "",
) -> Any:
    """Return the declaration of a setting, as a field of its settings dataclass.

    Parameters
    ----------
    default
        Its value when the study says nothing, SI; its type decides the kind: a number,
        a whole number (int), true or false (bool), a text (str), one word of `choices`,
        a range (`tolstat.Range`), a quantity of any kind (`tolstat.Measure`), a list of
        numbers (tuple), a table by name (dict) or a list of rows (tuple) with
        `columns`.
    sentence : str
        A few words of description.
    unit : str
        SI unit of a number, a range or a list that has one.
    above, at_least, at_most : float, optional
        Bounds of a number, or of each in a list; the first is excluded.
    choices : sequence of str
        The words allowed, for a setting that is a word.
    presets : dict of str to float or None, optional
        Words that stand for a number, or for None.
    count : tuple of int
        How many numbers a list has, at least and at most.
    columns : dict of str to Column, optional
        Of a table or a list of rows; see `column`.
    group : str
        Heading in a new study, such as "geometry", of settings that stand together.
    """
    kind: kinds.Kind
    check_si(unit or "1")
    if columns is not None:
        kind = kinds.Rows(dict(columns), named=isinstance(default, Mapping))
    elif isinstance(default, bool):
        kind = kinds.Boolean()
    elif choices:
        kind = kinds.Word(tuple(choices))
    elif isinstance(default, str):
        kind = kinds.Text()
    elif isinstance(default, Measure):
        kind = kinds.Quantity()
    elif isinstance(default, Range):
        integer = isinstance(default.lower, int) and isinstance(default.upper, int)
        end = kinds.Number(unit or "1", above, at_least, at_most, whole=integer)
        kind = kinds.Interval(end)
    else:
        several = isinstance(default, tuple)
        integer = isinstance((*default, 0.0)[0] if several else default, int)
        number = kinds.Number(unit, above, at_least, at_most, presets or {}, integer)
        least = 0 if default == () else count[0]
        kind = kinds.Numbers(number, least, count[1]) if several else number
    metadata = {"sentence": sentence, "kind": kind, "group": group}
    if isinstance(default, dict):
        return dataclasses.field(default_factory=lambda: default, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def column(
    sentence: str, *, unit: str = "", like: Any = 0.0, **bounds: Any
) -> kinds.Column:
    """Return the declaration of a column of a table or of rows.

    Parameters
    ----------
    sentence : str
        A few words of description.
    unit : str
        SI unit of its numbers.
    like
        A value of the type that it holds, as the default of a `setting`.
    **bounds
        `above`, `at_least`, `at_most`, `choices`, as in a `setting`.
    """
    declared = setting(like, sentence, unit=unit, **bounds)
    return kinds.Column(sentence, declared.metadata["kind"])


def settings_of(model: Model) -> dict[str, Setting]:
    """Return the declared settings of a model, by name."""
    settings = {}
    if not dataclasses.is_dataclass(model.settings):
        raise model.fault(f"settings is a frozen dataclass, not {model.settings!r}")
    for field in dataclasses.fields(model.settings):
        factory = field.default_factory
        default = field.default if factory is dataclasses.MISSING else factory()
        declared = field.metadata
        if "kind" not in declared:
            raise model.fault(
                f"the setting {field.name} is not declared; write {field.name}: ... = "
                'tolstat.setting(default, "what it is")'
            )
        try:
            default = declared["kind"].checked(default)
        except ModelError as error:
            raise model.fault(f"the default of {field.name}: {error}") from None
        words = (declared[key] for key in ("sentence", "kind", "group"))
        settings[field.name] = Setting(field.name, default, *words)
    return settings


def setting_of(model: Model, name: str) -> Setting:
    """Return one declared setting, by its name as typed; refuse an unknown one."""
    settings = settings_of(model)
    if name not in settings:
        raise model.fault(f"no such setting; {allowed_names(name, settings)}")
    return settings[name]


def make(model: Model, values: Mapping[str, Any] | None = None) -> Any:
    """Return `model.settings` with values by name, SI, or defaults.

    Raises ModelError if a name or a value is wrong, or values do not fit each other.
    """
    checked = {}
    for name, value in (values or {}).items():
        try:
            checked[name] = setting_of(model, name).kind.checked(value)
        except ModelError as error:
            raise ModelError(f"setting {name} = {value!r}: {error}") from None
    try:
        return model.settings(**checked)
    except ModelError:
        raise
    except (TypeError, ValueError) as error:  # values that do not fit each other
        raise ModelError(f"{error}") from error


def read(model: Model, values: Mapping[str, Any]) -> Any:
    """Return `model.settings` with the values of a study file, by name.

    Raises ModelError or UnitError if a name or a value is wrong.
    """
    return make(
        model, {n: setting_of(model, n).kind.read(v) for n, v in values.items()}
    )
