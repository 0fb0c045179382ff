"""Models by name: those of tolstat, of installed packages, and custom ones."""

import importlib
import importlib.util
import pickle
import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path

from tolstat.errors import Advice, ModelError, Remedy, allowed_names, told
from tolstat.model.checked import check_model
from tolstat.model.contract import Model
from tolstat.operating_system import cannot_isolate

# name in study files: module and class
MACHINES = {
    "stand": ("tolstat.machines.stand.machine", "Stand"),
    "dimension_chain": ("tolstat.machines.dimension_chain.machine", "DimensionChain"),
    "planetary": ("tolstat.machines.planetary.machine", "Planetary"),
    "elastic_machine": ("tolstat.machines.elastic_machine.machine", "ElasticMachine"),
    "rolling_block": ("tolstat.machines.rolling_block.machine", "RollingBlock"),
    "ring": ("tolstat.machines.ring.machine", "Ring"),
    "results": ("tolstat.machines.results.machine", "Results"),
}
GROUP = "tolstat.machines"  # entry points of installed packages
ANY = "FILE.py:NAME"
FMU = ".fmu"
COMMAND = "exec:"
_custom: dict[str, Model] = {}  # on the command line, for this process
_places: dict[str, str] = {}  # where these came from
_loaded: dict[int, tuple[Model, str]] = {}  # and where others of their names did, by id
_isolating = False


def names() -> list[str]:
    """Return the names of all models."""
    return list(dict.fromkeys([*_installed(), *_custom]))


def custom_names() -> list[str]:
    """Return the names of the models that this process has loaded from files."""
    return [*_custom]


def is_source(text: str) -> bool:
    """Return whether a text says where a custom model is, as --machine takes it."""
    return ":" in text or text.endswith(FMU)  # also of a command


def _installed() -> list[str]:
    """Return the names of the models of tolstat and of installed packages."""
    return [*MACHINES, *(point.name for point in entry_points(group=GROUP))]


def place_of(model: Model) -> str:
    """Return the value of --machine that finds a model; empty if it is installed."""
    if model.name in MACHINES or model.name in _installed():  # that one is slow
        return ""
    _, source = _loaded.get(id(model.unwrapped), (model, ""))
    return source or _places.get(model.name, ANY)


def find(model: str | Model) -> Model:
    """Return a model by its name; a model object is returned as it is.

    One that asks for it, or each one in `isolating`, is evaluated in other processes.

    Parameters
    ----------
    model : str or Model
        A name of `names()`, or a custom model.

    Raises
    ------
    ModelError
        If there is no such model, or the object is not a model.
    """
    base = _by_name(model) if isinstance(model, str) else check_model(model)
    plain = base.unwrapped is base and base.isolation is None
    if plain and (base.isolated or _isolating):
        return isolated(base)
    return base


def _by_name(model: str) -> Model:
    if model in _custom:
        return _custom[model]
    if model in MACHINES:
        module, kind = MACHINES[model]
        return check_model(getattr(importlib.import_module(module), kind))
    for point in entry_points(group=GROUP, name=model):
        try:
            loaded = check_model(point.load())
        except Exception as error:
            message = f"{point.value} cannot be loaded: {told(error)}"
            raise ModelError(message) from error
        if loaded.name != model:
            raise ModelError(f"the model of {point.value} has the name '{loaded.name}'")
        return loaded
    raise ModelError(
        f"no model is called '{model}'; {allowed_names(model, names())}",
        Advice(Remedy.CUSTOM_MODEL),
    )


def isolated(base: Model, longest: float = 0.0) -> Model:
    """Return a model that is evaluated in other processes, which find it there.

    A trial may last so long, s; 0 is 50 times the first one, and a minute at least.
    Raises ModelError if they cannot find it, or this system has no such processes.
    """
    from tolstat.isolation.isolated_model import Isolated

    if reason := cannot_isolate():
        raise ModelError(reason)
    if isinstance(base, Isolated):
        return Isolated(base.base, base.load, longest or base.longest)
    source = place_of(base)
    if source == ANY:
        try:
            content = pickle.dumps(base)
        except Exception as error:
            raise lost(base) from error
        if type(base).__module__ == "__main__":
            raise lost(base)
        return Isolated(base, partial(pickle.loads, content), longest)
    if not source:
        return Isolated(base, partial(_by_name, base.name), longest)
    return Isolated(base, partial(load, resolved(source)), longest)


def lost(model: Model) -> ModelError:
    """Return the error that other processes cannot find a model."""
    return ModelError(
        f"model '{model.name}' is an object of this process, so other processes "
        "cannot find it; load it from its file (tolstat.catalogue.load)",
        Advice(Remedy.CUSTOM_MODEL),
    )


@contextmanager
def isolating() -> Iterator[None]:
    """Let all models that are found meanwhile be evaluated in other processes."""
    global _isolating
    before, _isolating = _isolating, True
    try:
        yield
    finally:
        _isolating = before


def load(source: str) -> Model:
    """Return a custom model; from now on this process finds it by its name.

    Parameters
    ----------
    source : str
        "FILE.py:NAME": a Python file, and the class or object in it; "FILE.fmu": an
        FMU; "exec:COMMAND": a command with {input} and {output}.

    Raises
    ------
    ModelError
        If the file cannot be run, or has no such model.
    """
    loaded: object
    if source.startswith(COMMAND):
        from tolstat.command.command_model import CommandModel  # seldom needed

        loaded = CommandModel(source.removeprefix(COMMAND))
    elif source.endswith(FMU):
        from tolstat.fmu.fmu_model import FmuModel  # seldom needed

        loaded = FmuModel(Path(source))
    else:
        loaded = _object(source)
    model = check_model(loaded)
    if model.name in _installed():
        raise ModelError(
            f"{source}: '{model.name}' is the name of an installed model; choose "
            "another"
        )
    _custom[model.name], _places[model.name] = model, source
    _loaded[id(model)] = model, source
    return model


def resolved(source: str) -> str:
    """Return the value of --machine that finds a model from any working directory."""
    if source.startswith(COMMAND):
        return source
    file, colon, name = ("", "", "") if source.endswith(FMU) else source.rpartition(":")
    return f"{Path(file or source).resolve()}{colon}{name}"


def _object(source: str) -> object:
    """Return the class or object that a Python file holds under a name."""
    file, _, name = source.rpartition(":")
    path = Path(file)
    if not file or not name.isidentifier():
        raise ModelError(
            f"'{source}': FILE.py:NAME is expected, such as stack.py:Stack, or FILE.fmu"
        )
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
    if _isolating:  # its import may end the process
        from tolstat.isolation.isolated_model import processes_of

        processes_of(partial(load, resolved(source))).digest()
    module_name = f"tolstat_machine_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path.resolve())
    if spec is None or spec.loader is None:
        raise ModelError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    sys.path.insert(0, str(path.resolve().parent))  # modules beside it, as Python does
    try:
        with chdir("."):  # it may leave it
            spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # also SystemExit
        raise ModelError(f"{path} cannot be run: {told(error)}") from error
    finally:
        sys.path.pop(0)
    if not hasattr(module, name):
        models = [
            key
            for key, value in vars(module).items()
            if isinstance(value, Model)
            or (isinstance(value, type) and issubclass(value, Model) and value != Model)
        ]
        raise ModelError(f"{path} has no {name}; {allowed_names(name, models)}")
    return getattr(module, name)
