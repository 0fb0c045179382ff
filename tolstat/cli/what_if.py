"""tolstat what-if: other tolerances without a run, or the study of a run with them."""

import os
import re
import tomllib
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import click

from tolstat.answers.next_steps import command, to_change
from tolstat.answers.output_file import replace
from tolstat.answers.what_if.fresh_study import fresh_study
from tolstat.answers.what_if.scenarios import what_if as estimate
from tolstat.cli import options
from tolstat.errors import QuestionError, RunFileError, StudyError, TolstatError
from tolstat.store.open_run import open as open_run
from tolstat.study.editor import StudyChange

SEPARATOR = "or"
NAMED = re.compile(r"\s*([^\W\d]\w*)\s*([^\w\s].*?)\s*", re.DOTALL)


@click.command("what-if")
@options.run_file
@click.argument("deviations", metavar="NAME=TOLERANCE...", nargs=-1)
@options.delivered()
@options.limits
@options.isolate
@options.flag(
    "Weight the stored trials, although the model is cheap enough to evaluate.",
    "--reweight",
)
@options.path_option(
    "--write",
    metavar="STUDY.toml",
    help="Write the study of a fresh run that proves the answer, and no answer.",
)
def what_if(
    source: Path,
    deviations: tuple[str, ...],
    delivery: options.Delivery,
    limits: tuple[str, ...],
    reweight: bool,
    write: Path | None,
) -> None:
    """Show a run with other tolerances, sizes, shifts or limits.

    As in [deviations] of a study: rod_length="+-0.6 mm" crank_radius=IT11
    runout='{ tolerance = "0..30 um", distribution = "uniform" }'. "B2+=0.02 mm" shifts
    B2, and leaves all else; so does B2='{ shift = "0.02 mm" }'.

    All changes make one scenario: sleeve=h8 B2=h9. If a name has several changes, each
    change is a scenario: sleeve=h8 sleeve=h11 "B2+=0.02 mm" are three. The word "or"
    separates scenarios of several changes: sleeve=h8 B2=h9 or sleeve=h11.

    A cheap model evaluates the trials again, with the same seed. Otherwise the stored
    trials are weighted by the ratio of densities. Tolerances that they do not cover are
    refused; --write STUDY.toml writes the study of a fresh run that covers them.
    """
    scenarios, limited = scenarios_in(deviations), limits_in(limits)
    change = StudyChange(scenarios[0], limited)
    if write:
        if any(delivery):
            raise click.UsageError("--write takes no -o, --json or --csv")
        if len(scenarios) > 1:
            raise click.UsageError("--write takes one scenario")
        _write(write, source, change)
        return
    delivery.check()
    asked: Any = scenarios if len(scenarios) > 1 else scenarios[0]
    try:
        answer = estimate(
            source, asked, limits=limited, evaluate=False if reweight else None
        )
    except (QuestionError, StudyError) as error:
        advice = fresh_run_advice(source, change) if len(scenarios) == 1 else ""
        raise type(error)(f"{error}{advice}", *error.advice) from None
    delivery.deliver(answer)


def _write(path: Path, source: Path, change: StudyChange) -> None:
    """Write the study of a fresh run, and print the command that runs it."""
    options.check_study_output(path)
    if os.path.lexists(path):
        raise RunFileError(f"{path} exists and is not replaced; give another name")
    run = open_run(source)
    text = fresh_study(run, change, folder=path.parent)
    replace(path, text.encode())
    typed = command("run", path, machine=run.machine)
    options.say(f"study in {path}; run it: {typed}")


def fresh_run_advice(source: Path, change: StudyChange) -> str:
    """Return the command for the study of a fresh run; empty if there is none."""
    run = open_run(source)
    try:
        fresh_study(run, change)
    except TolstatError:
        return ""
    write, _ = to_change(run, change, "what-if")
    return f"\n  `{write}` writes the study of a fresh run"


def scenarios_in(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Return scenarios: separated by "or", or one for each change of a name."""
    if SEPARATOR in texts:
        parted = groupby(texts, SEPARATOR.__eq__)
        groups = [[*changes] for is_separator, changes in parted if not is_separator]
        if len(groups) <= texts.count(SEPARATOR):
            raise StudyError(f'"{SEPARATOR}" stands between two scenarios')
        return [deviations_in(group) for group in groups]
    names = [named[1] for text in texts if (named := NAMED.fullmatch(text))]
    if len({*names}) < len(names):
        return [deviations_in([text]) for text in texts]
    return [deviations_in(texts)]


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
        if rest[:2] in ("+=", "-=") and not option:
            entries[name] = {"shift": rest}
        else:
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
