"""What a remedy of a run is, and its commands as a person types them."""

from __future__ import annotations

import shlex

from click.testing import CliRunner

import tolstat
from tolstat.answers.next_steps import typed_entries
from tolstat.answers.remedy.changed_entries import changeable_entries, changed_entries
from tolstat.cli.main import main


def typed(command):
    """Type a command; return what it prints."""
    done = CliRunner().invoke(main, shlex.split(command)[1:])
    assert done.exit_code in (0, 3), f"{command}\n{done.output}"
    return done.output


def remedy_of(run):
    """The remedy of a run, as its summary has it."""
    return tolstat.summary(run).findings.remedy


def follow(commands):
    """Write and run the changed study; return its run."""
    write, again = map(str, commands)
    printed = typed(write)
    assert again in " ".join(printed.split()), printed
    typed(again)
    return tolstat.open(shlex.split(again)[2].removesuffix(".toml") + ".h5")


def halved(run, *names):
    """Half the tolerances of entries with some contributors, as what-if takes them."""
    entries = changeable_entries(run)
    change = entries.design.none
    for i, members in enumerate(entries.members):
        if {*members} & {*names} and entries.design.free[i]:
            change = change.with_entry(i, ratio=0.5)
    return typed_entries(changed_entries(run, entries, change))
