"""Commands that documents show: what to type next."""

from __future__ import annotations

from collections.abc import Sequence

from tolstat.deviations.names import expand
from tolstat.store.commands import command
from tolstat.store.stored_run import Run
from tolstat.units.scale import figures


def to_extend(run: Run, trials: int) -> str:
    """Return the command that adds trials to a run; empty where none can be added."""
    if run.sampling not in ("random", "sobol") or trials <= run.trials:
        return ""
    return command("extend", run.path, "--trials", trials, machine=run.machine)


def to_halve(run: Run, parts: Sequence[str]) -> str:
    """Return the command that writes a study with some tolerances halved.

    Empty where a tolerance is not the same to both sides, or its distribution is not
    normal: what half of it is has to be chosen then.
    """
    halves = {}
    for name in parts:
        assumed, scale = run.assumed[name], run.scales[name]
        lower, upper = assumed.tolerance
        if not assumed.words.startswith("normal, +-") or lower != -upper:
            return ""
        halves[name] = f"+-{figures(scale.factor * upper / 2)} {scale.mark}"
    stem = parts[0].rpartition("_")[0]
    every = [each.name for each in run.contributors]
    if (
        set(expand(stem, every) if stem else ()) == set(parts)
        and len({*halves.values()}) == 1
    ):  # all parts of one name
        halves = {stem: halves[parts[0]]}
    asked = (f"{name}={words}" for name, words in halves.items())
    study = run.path.with_name(f"{run.path.stem}-halved.toml")
    return command("what-if", run.path, *asked, "--write", study, machine=run.machine)
