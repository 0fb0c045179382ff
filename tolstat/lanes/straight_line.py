"""Compiled functions of a graph: a line for each of its nodes."""

import hashlib
import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import platformdirs

from tolstat.lanes.graph import INFIX, Node, Value, in_order

TRACED, DIGITS = "traced_", 16  # the name of a module: this and a digest
HEAD = '''"""Straight-line code of traced equations."""

import numpy as np

from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
'''


def constants_of(outputs: Iterable[Value]) -> list[Node]:
    """Return the nodes constant in a phase that what moves, or an output, needs."""
    ends = [x for x in outputs if isinstance(x, Node)]
    used = [arg for node in in_order(ends) if node.moves for arg in node.nodes]
    constants = {node for node in (*ends, *used) if not node.moves}
    return sorted(constants, key=lambda node: node.number)


def text_of(
    functions: Mapping[str, Sequence[Value]], rows_of: Mapping[str, Mapping[Any, int]]
) -> str:
    """Return the source of functions that fill rows with outputs.

    Parameters
    ----------
    functions : dict of str to sequence of values
        The outputs of each function.
    rows_of : dict of str to dict of node or name to int
        Rows of `moment` (sides of crossings), `y` (states by name) and `p` (constants).
    """
    parts = [HEAD]
    for name, outputs in functions.items():
        names: dict[Node, str] = {}
        lines = []

        def word(x: Value, names: Mapping[Node, str] = names) -> str:
            return names[x] if isinstance(x, Node) else repr(float(x))

        for node in in_order(outputs):
            if not node.moves and node not in rows_of["p"]:
                continue
            names[node] = f"v{len(names)}"
            lines.append(f"    {names[node]} = {_expression(node, rows_of, word)}\n")
        written = "".join(f"{word(x)}, " for x in outputs)
        parts += [
            f"\n\n@compiled(rates_signature)\ndef {name}(moment, y, p, out):\n",
            *lines,
            f"    write(out, 0, ({written}))\n",
        ]
    return "".join(parts)


def _expression(node, rows_of, word):
    """Return the right-hand side of a node's line."""
    if node in rows_of["p"]:
        row = f"rows(p)[{rows_of['p'][node]}]"
        return f"{row} > 0.5" if node.is_mask else row
    if node.op == "t":
        return "rows(moment)[0]"
    if node.op == "moment":
        return f"rows(moment)[{node.args[0]}]"
    if node.op == "y":
        return f"rows(y)[{rows_of['y'][node.args[0]]}]"
    if node.op == "side":
        return f"rows(moment)[{rows_of['moment'][node.args[0]]}]"
    words = [word(arg) for arg in node.args]
    if node.op in INFIX:
        return f"{words[0]} {node.op} {words[1]}"
    if node.op == "~":
        return f"~{words[0]}"
    function = "where" if node.op == "bend" else node.op
    return f"np.{function}({', '.join(words)})"


def is_traced(function: Any) -> bool:
    """Return whether a function is of a text that was compiled here."""
    module = getattr(function, "__module__", None) or ""
    return re.fullmatch(rf"{TRACED}[0-9a-f]{{{DIGITS}}}", module) is not None


def compiled_text(text: str) -> Any:
    """Return the module of a text; it is kept as a file, so that its code is, too."""
    name = TRACED + hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(chosen) if chosen else platformdirs.user_cache_path("tolstat")
    path = home / "traced" / f"{name}.py"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text("utf-8") != text:
            temporary = path.with_suffix(f".{os.getpid()}")
            temporary.write_text(text, "utf-8")
            temporary.replace(path)
    except OSError:  # compiled in each session
        module: Any = type(sys)(name)
        exec(compile(text, f"<{name}>", "exec"), module.__dict__)
        return module
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    sys.modules[name] = module  # Numba looks for it there
    spec.loader.exec_module(module)  # type: ignore[union-attr]
    return module
