"""The commands of tolstat: each in the file of its name, loaded when it is called."""

from __future__ import annotations

import click

from tolstat.cli.group import EXIT_CODES, Group


@click.group(
    cls=Group,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXIT_CODES,
    files=(
        "run", "resume", "extend", "verify", "show", "trial", "view", "report",
        "what_if", "compare", "allocate", "batch", "runs", "export", "models", "doctor",
    ),
)  # fmt: skip
@click.version_option(package_name="tolstat", prog_name="tolstat")
def main() -> None:
    """Monte Carlo tolerance analysis with the dynamics in the loop.

    A machine is built thousands of times on paper, each time with its own random
    manufacturing deviations; every one of them is simulated.
    """
