"""The command line as a whole: how refusals end it, and what all its commands know."""

from __future__ import annotations

import errno
import os
import sys

import click

from tolstat.errors import TolstatError
from tolstat.literal import visible

EXIT_CODES = """
\b
Exit codes:
  0    done
  1    something broke, or is damaged; what was stored before is safe
  2    what was asked for is wrong, and nothing was done
  3    done, and a limit is not met (run, resume, extend, batch, allocate)
  130  stopped by Ctrl-C, SIGTERM or SIGHUP; what is finished is stored
"""


def _load_machine(
    ctx: click.Context, option: click.Parameter, places: tuple[str, ...]
) -> None:
    """Let machines of one's own be found by their names."""
    for place in places:
        from tolstat.catalogue import load

        load(place)


class Group(click.Group):
    """Commands whose refusals are sentences, and that all know --machine."""

    def invoke(self, ctx: click.Context) -> object:
        """Run a command; what it refuses ends in a sentence."""
        try:
            return super().invoke(ctx)
        except TolstatError as error:
            click.echo(f"tolstat: {visible(str(error))}", err=True)
            sys.exit(error.exit_code)
        except MemoryError:
            click.echo("tolstat: there is not enough memory for this", err=True)
            sys.exit(1)
        except OSError as error:
            if error.errno != errno.ENOSPC or error.filename is not None:
                raise
            _say_nowhere_to_show()
            sys.exit(1)

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, which then knows --machine."""
        machine = click.Option(
            ["--machine"],
            metavar="FILE.py:NAME",
            multiple=True,
            callback=_load_machine,
            expose_value=False,
            is_eager=True,
            help="A machine of your own, for the studies and runs that name it. "
            "May be repeated.",
        )
        cmd.params.append(machine)
        super().add_command(cmd, name)


def _say_nowhere_to_show() -> None:
    """Say that the output goes nowhere: what is written to files refuses by itself."""
    # what waits would be written, and fail, once more when Python ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    click.echo(
        "tolstat: standard output is on a full disk, and cuts off what is shown; what "
        "was stored before is safe",
        err=True,
    )


def note(message: Warning | str, *_: object) -> None:
    """Say what Python would wrap into the place of a line of source."""
    click.echo(f"tolstat: note: {message}", err=True)
