"""The command line in a test, and a chain to run."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from click.testing import CliRunner

import tolstat
from tolstat.cli.main import main

TOLSTAT = Path(sys.executable).with_name("tolstat")


def call(*arguments):
    return CliRunner().invoke(main, [str(each) for each in arguments])


def wait_for_trials(path, process, trials):
    while process.poll() is None:
        if path.exists() and tolstat.open(path).counts["done"] >= trials:
            return
        time.sleep(0.2)  # reading takes as long as some trials
    raise AssertionError(process.communicate())


def chain(folder, name, *, title="chain", trials=1000, limit=">= 0.5 mm"):
    path = folder / f"{name}.toml"
    path.write_text(CHAIN.format(title=title, trials=trials, limit=limit))
    return path


CHAIN = """\
title = "{title}"
model = "dimension_chain"
trials = {trials}
seed = 3
[settings]
gap = "A - B"
[links]
A = {{ nominal = "10 mm", tolerance = "+-0.1 mm" }}
B = {{ nominal = "9 mm", tolerance = "+-0.1 mm" }}
[limits]
gap = "{limit}"
"""
