"""A template of a custom model that moves."""

import keyword
from importlib.resources import files
from pathlib import Path

from tolstat.errors import ModelError


def new_model(path: Path | str) -> str:
    """Return a model that runs, for you to change: a slider-crank with a buffer.

    It has states, an integral, peaks, a time at which the rates jump, a crossing and a
    history.

    Parameters
    ----------
    path : path
        Its file; the name without `.py` is the name of the model.

    Raises
    ------
    ModelError
        If the file has no such name.
    """
    path = Path(path)
    name = path.stem
    if path.suffix != ".py" or not name.isidentifier() or keyword.iskeyword(name):
        raise ModelError(
            f"{path}: a name of letters, digits and _ that ends in .py is expected, "
            "such as slider_crank.py"
        )
    model = "".join(part.capitalize() for part in name.split("_"))
    template = files("tolstat.answers").joinpath("templates", "model.py.txt")
    text = template.read_text("utf-8")
    for key, value in {"name": name, "file": str(path), "model": model}.items():
        text = text.replace(f"{{{key}}}", value)
    return text
