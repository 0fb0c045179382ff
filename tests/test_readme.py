"""What the READMEs say: links lead somewhere, code compiles, names are known."""

from __future__ import annotations

import re
import shutil
import tomllib
from typing import NamedTuple

import click
import pytest

from tests.conftest import ROOT
from tests.model.rich import Rich
from tests.model.test_settings import WRITTEN
from tolstat.cli.main import main
from tolstat.deviations.distributions import DISTRIBUTIONS
from tolstat.deviations.draw import SAMPLERS
from tolstat.model.settings import read
from tolstat.study.sampling import GIVEN
from tolstat.study.stopping_rule import KINDS
from tolstat.study.study import load
from tolstat.units.conversion import KNOWN, SPELLINGS

READMES = (
    "README.md",
    "runs/README.md",
    "tolstat/machines/README.md",
    "tolstat/statistics/README.md",
    "tests/benchmarks/README.md",
    ".github/CONTRIBUTING.md",
    ".github/CHANGELOG.md",
)


class Block(NamedTuple):
    """A fenced block of a README."""

    readme: str
    line: int
    language: str
    text: str


def blocks_of(readme):
    text = (ROOT / readme).read_text()
    found = re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [
        Block(readme, text[: each.start()].count("\n") + 1, each[1], each[2])
        for each in found
    ]


BLOCKS = [block for readme in READMES for block in blocks_of(readme)]


def of(*languages):
    """The blocks of some languages, as parameters."""
    return [
        pytest.param(each, id=f"{each.readme}:{each.line}")
        for each in BLOCKS
        if each.language in languages
    ]


def prose(readme):
    """A README without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", (ROOT / readme).read_text(), flags=re.M | re.S)


def headings(readme):
    """The anchors of a README, as forges name them."""
    found = re.findall(r"^#+ (.*)$", prose(readme), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in found}


@pytest.mark.parametrize("readme", READMES)
def test_links_and_pictures_exist(readme):
    targets = re.findall(r"\]\(([^)\s]+)\)", prose(readme))
    assert targets
    for target in targets:
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        there = (ROOT / readme).parent / path if path else ROOT / readme
        assert there.exists(), target
        assert not anchor or anchor in headings(there.relative_to(ROOT)), target


def test_every_picture_is_shown_and_every_study_named():
    shown = "".join((ROOT / readme).read_text() for readme in READMES)
    for picture in (ROOT / "runs" / "pictures").glob("*.png"):
        assert f"pictures/{picture.name})" in shown, picture
    gallery = (ROOT / "runs" / "README.md").read_text()
    for study in (ROOT / "runs").rglob("*.toml"):
        assert f"tolstat run {study.relative_to(ROOT)}" in gallery, study


def test_the_readme_shows_the_machine_and_the_study_as_they_are():
    shown = [each.text for each in blocks_of("README.md")]
    assert (ROOT / "runs" / "own" / "stack.py").read_text() in shown
    assert (ROOT / "runs" / "first.toml").read_text() in shown


def test_the_readme_is_short_and_has_the_command_that_tests():
    lines = (ROOT / "README.md").read_text().splitlines()
    assert len(lines) <= 190
    assert 'pip install -e ".[test]" && pytest' in lines  # .ci/run looks for it


@pytest.mark.parametrize("block", of("python"))
def test_python_compiles(block):
    compile(block.text, f"{block.readme}:{block.line}", "exec")


def test_there_is_no_block_of_an_unknown_language():
    assert {each.language for each in BLOCKS} == {"", "python", "sh", "toml"}


@pytest.mark.parametrize("block", of("toml"))
def test_studies_can_be_run(block, tmp_path):
    study = tomllib.loads(block.text)
    if "project" in study:
        return
    for data in (ROOT / "runs").glob("*.csv"):
        shutil.copy(data, tmp_path)
    model = "dimension_chain" if "links" in study else "stand"
    given = f'model = "{model}"\n' if "model" not in study else ""
    if "sampling" not in study and "trials" not in study:
        given += "trials = 16\nseed = 1\n"
    if "deviations" not in study and "correlation" in study:
        for name in study["correlation"]:
            given += f'deviations.{name[:-2]} = "+-1 %"\n'
    path = tmp_path / "shown.toml"
    path.write_text(given + block.text)
    assert len(load(path).deviations())


def commands(readme):
    """Yield every `tolstat ...` that a README names, words of one line or span."""
    spans = re.findall(r"`(tolstat [^`]+)`", prose(readme))
    lines = [x for each in blocks_of(readme) for x in each.text.splitlines()]
    for each in [*spans, *lines]:
        yield from re.findall(r"(?:^|&& )tolstat (.*)", each.replace("\n", " "))


@pytest.mark.parametrize("readme", READMES)
def test_commands_and_their_options_exist(readme):
    for words in commands(readme):
        name, *rest = words.split()
        if name.startswith("-"):
            continue
        command = main.get_command(None, name)
        assert command, words
        known = {
            option
            for each in command.params
            if isinstance(each, click.Option)
            for option in each.opts
        }
        used = re.findall(
            r"(?<![\w-])--?[a-z][a-z-]*", " ".join(rest).partition("  ")[0]
        )
        assert set(used) <= known, words


def test_every_command_is_in_the_readme():
    named = {words.split()[0] for words in commands("README.md")}
    assert set(main.list_commands(None)) <= named


def rows_under(heading):
    """First cells of the tables under a heading of the gallery, their code alone."""
    text = (ROOT / "runs" / "README.md").read_text()
    section = re.search(rf"^### {heading}\n(.*?)(?=^##|\Z)", text, re.M | re.S)[1]
    cells = re.findall(r"^\|(.*?)\|", section, re.MULTILINE)
    return {code for cell in cells for code in re.findall(r"`([^`]+)`", cell)}


def test_what_is_looked_up_is_all_there_is():
    assert rows_under("Deviations") == set(DISTRIBUTIONS)
    assert rows_under("Sampling") == {*SAMPLERS, *GIVEN}
    assert set(KINDS) <= rows_under("As many trials as it takes")
    text = (ROOT / "runs" / "README.md").read_text()
    listed = re.search(r"Known units:\n(.*?); joined", text, re.DOTALL)[1]
    found = set(re.split(r"[\s·,`]+|and ", listed)) - {"", "and"}
    assert found == set(KNOWN) - {"1", "count"} | {"µm", "µs", "°"}
    assert {"µm", "µs", "°"} <= set(SPELLINGS)


def test_settings_are_typed_as_shown():
    """The table's examples, of the stand and of a machine with every kind."""
    text = (ROOT / "runs" / "README.md").read_text()
    section = re.search(r"^### Settings\n(.*?)^###", text, re.M | re.S)[1]
    rows = re.findall(r"^\| [^|]+\|(.*)\|$", section, re.MULTILINE)
    codes = [code for row in rows for code in re.findall(r"`(\w.*?)`", row)]
    typed = [tomllib.loads(code) for code in codes if "=" in code]
    assert len(typed) == 14
    names = set(WRITTEN)
    for each in typed:
        (name,) = each
        if name in names:
            read(Rich(), each)
        else:
            load({"model": "stand", "trials": 1, "seed": 1, "settings": each})


def test_the_form_for_defects_asks_what_is_needed():
    form = (ROOT / ".github/ISSUE_TEMPLATE/defect.yml").read_text()
    asked = set(re.findall(r"^    id: (\w+)$", form, re.MULTILINE))
    assert asked == {"version", "command", "study", "happened", "expected"}
