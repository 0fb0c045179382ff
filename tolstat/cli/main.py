"""The commands of tolstat, loaded when they are called; errors are sentences."""

import ast
import errno
import importlib
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.resources import files
from typing import Any, NoReturn

import click

from tolstat.errors import TolstatError, allowed_names, package_that_fails, told
from tolstat.operating_system import address_space

FILES = {
    "new": "new",
    "run": "run", "decide": "run", "resume": "run", "extend": "run", "check": "check",
    "verify": "verify",
    "show": "show", "trial": "trial", "view": "trial", "report": "report",
    "parts": "parts", "what-if": "what_if", "explore": "explore", "compare": "report",
    "allocate": "allocate",
    "batch": "batch", "runs": "show", "export": "report", "models": "show",
    "doctor": "verify",
}  # fmt: skip  # of `tolstat.cli`, by command
LEAST_MEMORY = 1e9  # bytes of address space; libraries of two processors need 0.7e9
EXIT_CODES = """
\b
Exit codes:
  0    done
  1    something broke or is damaged; data stored before is safe
  2    the command, its options or its files are wrong; nothing was done
  3    a limit is not met (check, --check, allocate)
  4    a limit is undecided, and none is not met (check, --check)
  130  stopped by Ctrl-C, SIGTERM or SIGHUP; finished trials are stored
"""


class Group(click.Group):
    """Commands loaded when they are called; their errors are sentences."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(FILES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Load a command and add --machine to it."""
        if cmd_name not in FILES:
            return None
        if cmd_name not in self.commands:
            module = importlib.import_module(f"tolstat.cli.{FILES[cmd_name]}")
            command: click.Command = getattr(module, cmd_name.replace("-", "_"))
            command.params.append(MACHINE)
            self.commands[cmd_name] = command
        return self.commands[cmd_name]

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return a command; refuse an unknown one, with those that may be meant."""
        if args and args[0] not in FILES and not args[0].startswith("-"):
            ctx.fail(f"No such command '{args[0]}'; {allowed_names(args[0], FILES)}")
        return super().resolve_command(ctx, args)

    def format_commands(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """List the commands, each with the first sentence of its help; load none."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, _sentence(name)) for name in FILES])

    def make_context(self, *arguments: Any, **more: Any) -> click.Context:
        """Read the command line; an error ends it with a sentence."""
        with _sentences():  # help is printed here
            return super().make_context(*arguments, **more)

    def invoke(self, ctx: click.Context) -> object:
        """Run a command; an error ends it with a sentence."""
        with _sentences():
            _check_surroundings()
            return super().invoke(ctx)


@contextmanager
def _sentences() -> Iterator[None]:
    """End with a sentence at an error that is not a fault of this package."""
    try:
        yield
    except TolstatError as error:
        from tolstat.answers.next_steps import worded

        _end(worded(error), error.exit_code)
    except MemoryError:
        click.echo("tolstat: not enough memory", err=True)
        sys.exit(1)
    except Exception as error:
        if package := package_that_fails(error):
            _end_unloaded(package, error)
        if not isinstance(error, OSError):
            raise
        if error.filename is not None:  # too long a name, or nothing may be there
            _end(f"{error.filename}: {error.strerror}", 1)
        if error.errno not in (errno.ENOSPC, errno.EPIPE):
            raise
        # at exit Python would write its buffer, and fail again
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if error.errno == errno.EPIPE:  # its reader, such as head, has ended
            sys.exit(0)
        click.echo(
            "tolstat: the disk of standard output is full, and the output is cut "
            "off; data stored before is safe",
            err=True,
        )
        sys.exit(1)


def _end(words: str, code: int) -> NoReturn:
    """End with a sentence, in which every character is visible."""
    from tolstat.render.screen import Screen

    Screen(stderr=True).say(f"tolstat: {words}")
    sys.exit(code)


def _end_unloaded(package: str, error: Exception) -> NoReturn:
    """End with a sentence where a package that is needed cannot be loaded here."""
    settings = [name for name in os.environ if name.startswith(f"{package.upper()}_")]
    hint = f"; environment: {', '.join(sorted(settings))}" if settings else ""
    reason = " ".join(told(error).split())
    click.echo(f"tolstat: {package} cannot be loaded: {reason}{hint}", err=True)
    sys.exit(1)


def _check_surroundings() -> None:
    """Refuse too little memory, and a working directory that was removed.

    With less, packages cannot be loaded, and some try for long. Models are called in
    the working directory.
    """
    if (most := address_space()) < LEAST_MEMORY:
        click.echo(  # words of answers would load libraries
            f"tolstat: {most / 1e6:.0f} MB of memory are allowed (ulimit -v, -d), and "
            f"commands need {LEAST_MEMORY / 1e6:.0f} MB",
            err=True,
        )
        sys.exit(1)
    try:
        os.getcwd()
    except OSError as error:
        raise TolstatError(
            f"the working directory cannot be used: {error.strerror}; change to another"
        ) from None


def _sentence(command: str) -> str:
    """Read the first line of a command's help from its source."""
    name, file = command.replace("-", "_"), f"{FILES[command]}.py"
    source = files("tolstat.cli").joinpath(file).read_text("utf-8")
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.FunctionDef) and statement.name == name:
            return (ast.get_docstring(statement) or "").partition("\n")[0]
    raise AssertionError(f"{file} has no function {name}")


def _load_machine(
    ctx: click.Context, option: click.Parameter, machines: tuple[str, ...]
) -> None:
    for machine in machines:
        from tolstat.catalogue import load

        load(machine)


class Machine(click.Option):
    """The option --machine; with --isolate another process imports its file first."""

    def handle_parse_result(
        self, ctx: click.Context, opts: Mapping[str, Any], args: list[str]
    ) -> tuple[Any, list[str]]:
        """Load the models."""
        if not opts.get("isolate"):
            return super().handle_parse_result(ctx, opts, args)
        from tolstat.catalogue import isolating

        with isolating():
            return super().handle_parse_result(ctx, opts, args)


MACHINE = Machine(
    ["--machine"],
    metavar="FILE.py:NAME|FILE.fmu|exec:COMMAND",
    multiple=True,
    callback=_load_machine,
    expose_value=False,
    is_eager=True,
    help="A custom model, an FMU or a command, for the studies and runs that name it. "
    "May be repeated.",
)


def note(message: Warning | str, *_: object) -> None:
    """Print a warning as a sentence; Python would show a line of source with it."""
    click.echo(f"tolstat: note: {message}", err=True)


@click.group(
    cls=Group,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXIT_CODES,
)
@click.version_option(package_name="tolstat", prog_name="tolstat")
def main() -> None:
    """Monte Carlo tolerance analysis with the dynamics in the loop.

    It builds thousands of machines on paper, each with random manufacturing
    deviations, and simulates each.
    """
