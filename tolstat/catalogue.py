"""Models by name: those of tolstat, of installed packages, and custom ones."""

import importlib
import importlib.util
import sys
from contextlib import chdir
from importlib.metadata import entry_points
from pathlib import Path

from tolstat.errors import Advice, ModelError, Remedy, allowed_names, told
from tolstat.model.checked import check_model
from tolstat.model.contract import Model

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
_custom: dict[str, Model] = {}  # on the command line, for this process
_places: dict[str, str] = {}  # where these came from


def names() -> list[str]:
    """Return the names of all models."""
    return list(dict.fromkeys([*_installed(), *_custom]))


def _installed() -> list[str]:
    """Return the names of the models of tolstat and of installed packages."""
    return [*MACHINES, *(point.name for point in entry_points(group=GROUP))]


def place_of(model: Model) -> str:
    """Return the value of --machine that finds a model; empty if it is installed."""
    if model.name in _installed():
        return ""
    return _places.get(model.name, ANY)


def find(model: str | Model) -> Model:
    """Return a model by its name; a model object is returned as it is.

    Parameters
    ----------
    model : str or Model
        A name of `names()`, or a custom model.

    Raises
    ------
    ModelError
        If there is no such model, or the object is not a model.
    """
    if not isinstance(model, str):
        return check_model(model)
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


def load(source: str) -> Model:
    """Return a custom model; from now on this process finds it by its name.

    Parameters
    ----------
    source : str
        "FILE.py:NAME": a Python file, and the class or object in it.

    Raises
    ------
    ModelError
        If the file cannot be run, or has no such model.
    """
    file, _, name = source.rpartition(":")
    path = Path(file)
    if not file or not name.isidentifier():
        raise ModelError(
            f"'{source}': FILE.py:NAME is expected, such as stack.py:Stack"
        )
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
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
    model = check_model(getattr(module, name))
    if model.name in _installed():
        raise ModelError(
            f"{source}: '{model.name}' is the name of an installed model; choose "
            "another"
        )
    _custom[model.name], _places[model.name] = model, source
    return model
