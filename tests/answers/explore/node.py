"""The script of a page, without a browser."""

import csv
import json
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("scenarios.js")


def data_of(explored):
    """Return the data of a page."""
    return json.loads(explored.data.text())


def readings(explored, folder, changes):
    """Return what the script reads from a page's data in some scenarios."""
    node = shutil.which("node") or pytest.skip("no node on this machine")
    data, asked = folder / "data.json", folder / "changes.json"
    data.write_text(explored.data.text(), encoding="utf-8")
    asked.write_text(json.dumps(changes), encoding="utf-8")
    done = subprocess.run(
        [node, SCRIPT, data, asked], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def rows_of(path):
    """Return the rows of a table, as texts."""
    with path.open(encoding="utf-8", newline="") as file:
        return [*csv.DictReader(file)]
