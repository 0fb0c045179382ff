"""A wrong study is refused before anything runs: key, value, what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from tolstat.cli.main import main
from tolstat.errors import StudyError
from tolstat.study.study import load

HEAD = 'model = "stand"\ntrials = 8\nseed = 1\n'

WRONG = {
    "unknown key": (HEAD + "trails = 9\n", ["trails", "did you mean 'trials'"]),
    "unknown model": (
        'model = "stnad"\ntrials = 8\nseed = 1\n', ['model = "stnad"', "did you mean 'stand'"],
    ),
    "missing model": ("trials = 8\nseed = 1\n", ["model: missing"]),
    "missing seed": ('model = "stand"\ntrials = 8\n', ["seed: missing", "repeatable"]),
    "missing trials": ('model = "stand"\nseed = 1\n', ["trials: missing"]),
    "no trials": ('model = "stand"\ntrials = 0\nseed = 1\n', ["trials = 0", "whole number"]),
    "half a trial": ('model = "stand"\ntrials = 1.5\nseed = 1\n', ["trials = 1.5"]),
    "trials in words": ('model = "stand"\ntrials = "many"\nseed = 1\n', ['trials = "many"']),
    "negative seed": ('model = "stand"\ntrials = 8\nseed = -1\n', ["seed = -1"]),
    "unknown sampling": (HEAD + 'sampling = "rnadom"\n', ["sampling", "'random'"]),
    "unknown setting": (
        HEAD + '[settings]\ncrank_sped = "7.5 rad/s"\n', ["crank_sped", "'crank_speed'"],
    ),
    "hertz": (HEAD + '[settings]\ncrank_speed = "7.5 Hz"\n', ["crank_speed", "rpm"]),
    "per minute": (HEAD + '[settings]\ncrank_speed = "72 1/min"\n', ["72 1/min", "rpm"]),
    "speed without unit": (
        HEAD + "[settings]\ncrank_speed = 7.5\n", ["crank_speed = 7.5", "with its unit"],
    ),
    "speed of zero": (
        HEAD + '[settings]\ncrank_speed = "0 rad/s"\n', ["crank_speed", "above 0"],
    ),
    "unknown choice": (
        HEAD + '[settings]\nvariant = "equalised"\n', ["variant", "'equalized'"],
    ),
    "half a cycle": (HEAD + "[settings]\ncycles = 1.5\n", ["cycles = 1.5", "whole"]),
    "no cycle": (HEAD + "[settings]\ncycles = 0\n", ["cycles = 0", "at least 1"]),
    "word for a number": (HEAD + '[settings]\nrtol = "fine"\n', ["rtol", "a number"]),
    "contact yaw in words": (
        HEAD + '[settings]\ncontact_yaw = "small"\n', ["contact_yaw", "cannot be read"],
    ),
    "unknown contributor": (
        HEAD + '[deviations]\nrod_lenght = "+-1 mm"\n',
        ["[deviations] rod_lenght", '"+-1 mm"', "'rod_length'"],
    ),
    "wrong unit": (
        HEAD + '[deviations]\nrod_length = "+-1 kg"\n', ["rod_length", "'kg'", "mm"],
    ),
    "angle without unit": (
        HEAD + '[deviations]\ncrank_angle = "+-0.01"\n', ["crank_angle", "unit is missing"],
    ),
    "length for a relative one": (
        HEAD + '[deviations]\nfriction = "+-1 mm"\n', ["friction", "plain number"],
    ),
    "negative tolerance": (
        HEAD + '[deviations]\nrod_length = "+--1.2 mm"\n', ["rod_length", "not negative"],
    ),
    "tolerance upside down": (
        HEAD + '[deviations]\nrod_length = "0.3..-0.1 mm"\n', ["rod_length", "lower end"],
    ),
    "decimal comma": (
        HEAD + '[deviations]\nrod_length = "+-1,2 mm"\n', ["rod_length", "comma"],
    ),
    "unknown distribution": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", distribution = "gauss" }\n',
        ["rod_length", "'gauss'", "normal"],
    ),
    "key of another distribution": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "uniform", cp = 1.33 }\n',
        ["rod_length", "uniform distribution has no key cp"],
    ),
    "shift outside": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", shift = "2 mm" }\n',
        ["rod_length", "outside the tolerance"],
    ),
    "cp of zero": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", cp = 0 }\n',
        ["rod_length", "above zero"],
    ),
    "mode outside": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "triangular", mode = "3 mm" }\n',
        ["rod_length", "outside the tolerance"],
    ),
    "no tolerance": (HEAD + "[deviations]\nrod_length = { cp = 1 }\n", ["tolerance is missing"]),
    "number for a tolerance": (
        HEAD + "[deviations]\nrod_length = 1.2\n", ["rod_length = 1.2", "+-1.2 mm"],
    ),
    "given twice": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\nrod_length_1 = "+-2 mm"\n',
        ["rod_length_1", "give it once"],
    ),
    "unknown response": (
        HEAD + '[limits]\nextra_los = "<= 3 %"\n', ["[limits] extra_los", "'extra_loss'"],
    ),
    "limit upside down": (
        HEAD + '[limits]\nrod_force = "180..20 kN"\n', ["rod_force", "upside down"],
    ),
    "limit of another kind": (
        HEAD + '[limits]\nrod_force = "<= 3 %"\n', ["rod_force", "kN"],
    ),
    "limit without sign": (HEAD + '[limits]\nextra_loss = "3 %"\n', ["extra_loss", "<= 3"]),
    "no TOML": ("model = stand\n", ["not a TOML file", "line 1"]),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_wrong_studies(name, tmp_path):
    text, words = WRONG[name]
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(StudyError) as refused:
        load(path)
    for word in (str(path), *words):
        assert word in str(refused.value)
    # on the command line: exit code 2, the sentence, no traceback, no file
    shown = CliRunner().invoke(main, ["run", str(path)])
    assert shown.exit_code == 2
    assert words[0] in shown.stderr and "Traceback" not in shown.output
    assert not path.with_suffix(".h5").exists()


def test_all_problems_are_told_at_once(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(
        HEAD
        + '[settings]\ncycles = 0\n[deviations]\nrod = "1"\n[limits]\nyaw = "1 mm"\n'
    )
    with pytest.raises(StudyError) as refused:
        load(path)
    assert str(refused.value).count("\n") == 3


def test_a_missing_file_names_the_nearest():
    with pytest.raises(StudyError, match=r"did you mean .*khpt75\.toml"):
        load("runs/khpt57.toml")
    with pytest.raises(StudyError, match="a stored run"):
        load("runs/khpt75.h5")


def test_settings_and_presets(tmp_path):
    path = tmp_path / "right.toml"
    path.write_text(
        HEAD
        + '[settings]\ncrank_speed = "60 rpm"\ncontact_yaw = "fig4"\nmax_step = "0.5 ms"\n'
        + 'cycles = 3\nvariant = "equalized"\n[limits]\nrod_force = "<= 130 kN"\n'
    )
    study = load(path, trials=5, seed=9)
    assert study.settings.crank_speed == pytest.approx(6.283185307179586)
    assert study.settings.contact_yaw == 5.8e-4
    assert (study.settings.max_step, study.settings.cycles) == (5e-4, 3)
    assert (study.trials, study.seed) == (5, 9)
    assert sorted(study.limits) == ["rod_force_1", "rod_force_2"]


@pytest.mark.parametrize("path", sorted(Path("runs").glob("*.toml")), ids=str)
def test_the_studies_shipped_are_right(path):
    assert load(path).trials > 0
