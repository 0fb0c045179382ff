"""tolstat what-if: other tolerances without a run, or the study of a run with them."""

import os
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from tolstat.answers.next_steps import as_typed, command
from tolstat.answers.output_file import replace
from tolstat.answers.what_if.fresh_study import fresh_study
from tolstat.answers.what_if.reweighted_trials import what_if as estimate
from tolstat.cli import options
from tolstat.errors import QuestionError, RunFileError, StudyError, TolstatError
from tolstat.store.files_beside import free_name
from tolstat.store.open_run import open as open_run

NAMED = re.compile(r"\s*([^\W\d]\w*)\s*([^\w\s].*?)\s*", re.DOTALL)


@click.command("what-if")
@options.run_file
@click.argument("deviations", metavar="NAME=TOLERANCE...", nargs=-1)
@options.output_option("Also write a file: .html, .csv or .json.")
@options.form
@options.limits
@options.path_option(
    "--write",
    metavar="STUDY.toml",
    help="Write the study of a fresh run that proves the answer, and no answer.",
)
def what_if(
    source: Path,
    deviations: tuple[str, ...],
    output: Path | None,
    form: str | None,
    limits: tuple[str, ...],
    write: Path | None,
) -> None:
    """Estimate a run with other tolerances; nothing is simulated.

    As in [deviations] of a study: rod_length="+-0.6 mm" crank_radius=IT11
    runout='{ tolerance = "0..30 um", distribution = "uniform" }'. The stored trials are
    weighted by the ratio of densities. Tolerances that they do not cover are refused;
    --write STUDY.toml writes the study of a fresh run that covers them.
    """
    scenario = deviations_in(deviations), limits_in(limits)
    if write:
        if output or form:
            raise click.UsageError("--write takes no -o, --json or --csv")
        _write(write, source, *scenario)
        return
    options.check_delivery(output, form)
    try:
        answer = estimate(source, scenario[0], limits=scenario[1])
    except (QuestionError, StudyError) as error:
        advice = fresh_run_advice(source, deviations, limits)
        raise type(error)(f"{error}{advice}", *error.advice) from None
    options.deliver(answer, output, form)


def _write(path: Path, source: Path, deviations: Any, limits: Any) -> None:
    """Write the study of a fresh run, and print the command that runs it."""
    options.check_study_output(path)
    if os.path.lexists(path):
        raise RunFileError(f"{path} exists and is not replaced; give another name")
    run = open_run(source)
    text = fresh_study(run, deviations, limits=limits, folder=path.parent)
    replace(path, text.encode())
    typed = command("run", path, machine=run.machine)
    options.say(f"study in {path}; run it: {typed}")


def fresh_run_advice(
    source: Path, deviations: tuple[str, ...], limits: tuple[str, ...]
) -> str:
    """Return the command for the study of a fresh run; empty if there is none."""
    run = open_run(source)
    try:
        fresh_study(run, deviations_in(deviations), limits=limits_in(limits))
    except TolstatError:
        return ""
    study = run.study_file or run.path.with_suffix(".toml")
    path = as_typed(free_name(study, "what-if"))
    limited = [word for limit in limits for word in ("--limit", limit)]
    typed = command(
        "what-if", source, *deviations, *limited, "--write", path, machine=run.machine
    )
    return f"\n  `{typed}` writes the study of a fresh run"


def deviations_in(texts: Sequence[str]) -> dict[str, Any]:
    """Return deviations: NAME=TOLERANCE, or NAME={ ... } as in TOML."""
    return _entries_in(texts, "", 'NAME=TOLERANCE, such as rod_length="+-0.6 mm"')


def limits_in(texts: Sequence[str]) -> dict[str, Any]:
    """Return limits: "NAME <= 120 kN", or NAME = { ... } as in TOML."""
    return _entries_in(texts, "--limit ", 'such as "rod_force <= 120 kN"')


def _entries_in(texts: Sequence[str], option: str, example: str) -> dict[str, Any]:
    """Return entries by name; the value after = is TOML or a text."""
    entries: dict[str, Any] = {}
    for text in texts:
        named, typed = NAMED.fullmatch(text), f'{option}"{text}"'
        if not named:
            raise StudyError(f"{typed}: {example}")
        name, rest = named.groups()
        if name in entries:
            raise StudyError(f"{typed}: {name} is given twice")
        entries[name] = value_in(rest[1:], typed) if rest[0] == "=" else rest
    return entries


def value_in(value: str, typed: str) -> Any:
    """Return a value: TOML in braces or quotes, else a text."""
    value = value.strip()
    if value[:1] not in ("{", '"', "'"):
        return value
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError) as error:
        raise StudyError(f"{typed}: {error}") from None
