"""Arguments and options that several commands have in common."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def path_argument(name: str, metavar: str | None = None, **more: Any) -> Decorator:
    """Let a command be given a file, or several."""
    kind = click.Path(path_type=Path)
    return click.argument(name, metavar=metavar, type=kind, **more)


def path_option(*names: str, **more: Any) -> Decorator:
    """Let a command be given a file by an option."""
    return click.option(*names, type=click.Path(path_type=Path), **more)


def output_option(help: str, **more: Any) -> Decorator:
    """Let a command be told where to write."""
    return path_option("-o", "--output", help=help, **more)


def plot_option(help: str) -> Decorator:
    """Let a command be told where to draw."""
    return path_option("--plot", help=help)


def form(command: Callable[..., Any]) -> Callable[..., Any]:
    """Let a command be asked for its numbers, for other tools."""
    as_csv = click.option("--csv", "form", flag_value="csv", help="The numbers as CSV.")
    as_json = click.option(
        "--json", "form", flag_value="json", help="The numbers as JSON."
    )
    return as_json(as_csv(command))


run_file = path_argument("source", "RUN.h5")
regardless = click.option(
    "--regardless",
    is_flag=True,
    help="Continue although source, processor or study file have changed.",
)
closely = click.option(
    "--response",
    "responses",
    multiple=True,
    help="Put it in focus, instead of all that is limited. May be repeated.",
)


limits = click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar='"NAME <= VALUE"',
    help="Judged beside or instead of the study's limits. May be repeated.",
)
