"""Grids and tables: given trials."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import tolstat
from tolstat.answers.sweep.extremes_document import comparisons
from tolstat.errors import StudyError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.description import Description
from tolstat.study.study import load


@pytest.fixture
def study(tmp_path):
    def write(text, name="points.toml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


GRID = """\
model = "toy"
sampling = "grid"
[grid]
part = { from = "0 mm", to = "0.8 mm", points = 5 }
angle = ["0 deg", "90 deg"]
gain = [1, 2.5]
mode = ["plain", "odd"]
[deviations]
[limits]
gap = "<= 2 mm"
"""


def test_a_grid_is_the_product_of_its_axes(toy, study):
    run = tolstat.run(study(GRID), model=toy, workers=2)
    frame = run.frame()
    assert len(frame) == 5 * 2 * 2 * 2
    assert list(frame.columns[:2]) == ["gain", "mode"]  # settings are columns too
    seen = frame[["gain", "mode", "part_1", "angle"]].drop_duplicates()
    assert len(seen) == len(frame)
    np.testing.assert_array_equal(frame["part_1"], frame["part_2"])  # one name
    np.testing.assert_allclose(frame["gap"], 2 * frame["gain"] * frame["part_1"])
    assert set(frame["mode"]) == {"plain", "odd"}
    assert run.grid == ("gain", "mode", "part", "angle")  # the slowest first
    assert run.sampled is None
    np.testing.assert_allclose(
        np.unique(frame["part_1"]), np.linspace(0, 0.8e-3, 5), rtol=1e-15
    )


def test_signs_are_not_names(toy, study):
    text = 'model = "toy"\nsampling = "grid"\n[grid]\nspeed = ["+1 rpm", ".5 rpm"]\n'
    run = tolstat.run(study(text), model=toy)
    assert run.column("speed").dtype.kind == "f"
    assert run.scales["speed"].words(run.column("speed")[1]) == "0.5 rpm"


def test_no_block_spans_two_settings(toy, study, tmp_path):
    asked, over = load(study(GRID), model=toy), []
    with Workers(2) as crew:
        execute(
            asked, tmp_path / "grid.h5", crew, progress=lambda p: over.append(p.over)
        )
    assert over[-1] == 40  # each trial once


def test_constant_parts_go_with_a_grid(toy, study):
    path = study(
        'model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm", "0.1 mm"]\n'
        '[deviations]\npart_2 = { distribution = "constant", value = "0.3 mm" }\n'
    )
    frame = tolstat.run(path, model=toy).frame()
    np.testing.assert_allclose(frame["gap"], [0.6e-3, 0.8e-3])


def test_settings_that_change_the_model_are_refused(toy, study, monkeypatch):
    whole = toy.describe

    def describe(settings):
        contributors, responses = whole(settings)
        return Description(contributors, responses[: 1 if settings.gain > 1 else 2])

    monkeypatch.setattr(toy, "describe", describe)
    path = study('model = "toy"\nsampling = "grid"\n[grid]\ngain = [1, 2.5]\n')
    with pytest.raises(StudyError, match="gain: these settings change which"):
        load(path, model=toy)


def test_a_grid_samples_nothing(toy, study):
    with pytest.raises(StudyError, match="samples nothing"):
        load(study(GRID), model=toy, trials=5)
    with pytest.raises(StudyError, match="samples nothing"):
        load(study(GRID), model=toy, seed=5)


def test_a_table_is_built_row_by_row(toy, study, tmp_path):
    (tmp_path / "machines.csv").write_text(
        "# three machines\npart_1 [um],part_2 [mm],angle [deg]\n"
        "100,0.2,90\n-50, 0.1,0\n950,0,-90\n"
    )
    path = study('model = "toy"\nsampling = "table"\ntable = "machines.csv"\n')
    run = tolstat.run(path, model=toy)
    frame = run.frame()
    np.testing.assert_allclose(frame["part_1"], [1e-4, -5e-5, 9.5e-4])
    np.testing.assert_allclose(frame["angle"], np.radians([90, 0, -90]))
    np.testing.assert_allclose(frame["gap"][:2], [6e-4, 1e-4])
    assert list(frame["status"]) == ["done", "done", "not finite"]
    assert "3 trials of machines.csv" in run.notes[0]


def test_heads_of_another_program_are_named_by_columns(toy, study, tmp_path):
    (tmp_path / "adams.csv").write_text(
        "Nr;Teil 1 [um];Teil 2;T;Winkel [deg]\n1;100;0,2;21,5;90\n2;-50;0,1;22;0\n"
    )
    columns = '{ part_1 = "Teil 1", part_2 = "Teil 2 [mm]", angle = "Winkel" }'
    text = 'model = "toy"\nsampling = "table"\n[table]\ndata = "adams.csv"\n'
    text += f"columns = {columns}\n"
    run = tolstat.run(study(text), model=toy)
    np.testing.assert_allclose(run.column("part_2"), [2e-4, 1e-4])
    np.testing.assert_allclose(run.column("angle"), [np.pi / 2, 0])
    assert any("no entry names the column T;" in w for w in run.warnings)
    for before, after, words in (
        ('"Winkel"', '"Wink"', "has no column 'Wink'"),
        ('"Teil 1"', '"Teil 1 [mm]"', "column Teil 1 in um, the key columns in mm"),
    ):
        with pytest.raises(StudyError, match=words):
            load(study(text.replace(before, after)), model=toy)


def test_heads_of_a_publication_are_named_by_columns(toy, study, tmp_path):
    (tmp_path / "paper.csv").write_text(
        "no;Winkel;Spalt [um];T\n1;0;250;20\n2;9;260;21\n"
    )
    text = (
        'model = "toy"\nsampling = "grid"\n[grid]\nangle = ["0 deg", "90 deg"]\n'
        '[reference]\ndata = "paper.csv"\nlabel = "paper"\n'
        'columns = { angle = "Winkel [deg]", gap = "Spalt" }\n'
    )
    reference = tolstat.run(study(text), model=toy).reference
    np.testing.assert_allclose(reference.columns["angle"], np.radians([0, 9]))
    np.testing.assert_allclose(reference.columns["gap"], [250e-6, 260e-6])


def test_fig_4_by_the_shipped_study(tmp_path):
    """To 0.02 percentage points at every point of the spec's table."""
    run = tolstat.run("runs/khpt75-fig4.toml", output=tmp_path / "fig4.h5")
    assert run.trials == 61
    (compared,) = comparisons(run)
    assert len(compared.rows) == 8 and compared.caption == ()
    assert "paper's Fig. 4" in compared.title
    for row in compared.rows:
        (difference,) = row[3].main
        assert abs(1e2 * difference.value) < 0.02, row
    x, y = run.column("crank_difference"), run.column("extra_loss_run")
    np.testing.assert_allclose(
        np.interp(run.reference.columns["crank_difference"], x, y),
        run.reference.columns["extra_loss_run"], atol=2e-4,
    )  # fmt: skip


def test_a_grid_is_bitwise_the_same_for_any_workers(study, tmp_path):
    path = study(
        'model = "stand"\nsampling = "grid"\n[grid]\n'
        'crank_difference = { from = "0 mm", to = "2 mm", points = 5 }\n'
        'variant = ["indeterminate", "equalized"]\n'
    )
    one, two = (
        tolstat.run(path, workers=n, output=tmp_path / f"{n}.h5").frame()
        for n in (1, 2)
    )
    alone = tolstat.evaluate(
        "stand", {"crank_difference": np.linspace(0, 2e-3, 5)}, {"variant": "equalized"}
    )
    for name in alone.columns[:-2]:
        np.testing.assert_array_equal(one[name], two[name])
        np.testing.assert_array_equal(one[name][5:], alone[name])


def test_samplings_state_their_promise(toy, toy_study):
    for sampling, word in (("latin", "Latin hypercube"), ("sobol", "Sobol'")):
        text = toy_study.read_text()
        path = toy_study.with_name(f"{sampling}.toml")
        path.write_text(f'sampling = "{sampling}"\n{text}')
        run = tolstat.run(path, model=toy)
        assert word in run.sampled.promise and run.sampling == sampling
        assert run.counts["done"] > 950


def test_measured_parts_are_reported(tmp_path):
    text = Path("runs/khpt75-measured.toml").read_text()
    rods = Path("runs/rods.csv").read_text()
    (tmp_path / "rods.csv").write_text(rods)
    path = tmp_path / "fitted.toml"
    unit = 'unit = "mm"'
    path.write_text(text.replace(unit, f'{unit}, fit = "normal"'))
    study = load(path, trials=200)
    assert "normal distribution fitted to sizes of 120 parts" in study.notes[0]
    assert study.notes[0].endswith("doubtful")  # two machines made them
    lengths = np.array([float(r.split(",")[1]) for r in rods.splitlines()[4:]])
    mean, sigma = lengths.mean() - 2450, lengths.std(ddof=1)
    fitted = f"mean {mean:.4g} mm, sigma {sigma:.4g} mm"
    assert fitted in study.notes[0] and fitted in study.deviating.words["rod_length_1"]
    table = study.deviations()[:, 0]
    assert table.std() == pytest.approx(lengths.std() / 1e3, rel=0.2)
    plain = load("runs/khpt75-measured.toml", trials=200).deviations()[:, :2]
    possible = np.round(lengths - 2450, 2)
    assert set(np.round(plain.ravel() * 1e3, 2)) <= set(possible)


def measured(folder, model, parts):
    """A study of a machine that knows no nominal sizes."""
    table = "\n".join(["part_1 [mm]", *parts.split()])
    (folder / "parts.csv").write_text(table)
    study = {
        "model": "toy",
        "trials": 8,
        "seed": 1,
        "sampling": "random",
        "deviations": {
            "part_1": {"data": str(folder / "parts.csv"), "column": "part_1"}
        },
    }
    return load(study, model=model)


def test_values_that_look_like_sizes_have_a_warning(toy, tmp_path):
    (warning,) = measured(tmp_path, toy, "49.9 50.1 50.3").reading_warnings
    assert "49.9 to 50.3 mm" in warning and "`nominal`" in warning
    for honest in ("0.1 0.2 0.3", "-0.1 0.1", "0.050 0.060", "0 0"):
        assert not measured(tmp_path, toy, honest).reading_warnings


def test_a_lognormal_fit_reports_mean_and_sigma_of_deviations(toy, tmp_path):
    rows = np.exp(np.random.default_rng(1).normal(np.log(0.2), 0.5, 4000))
    folder, text = tmp_path, "\n".join(["part_1 [mm]", *(f"{row:.6f}" for row in rows)])
    (folder / "parts.csv").write_text(text)
    data = {"data": str(folder / "parts.csv"), "column": "part_1", "fit": "lognormal"}
    study = {"model": "toy", "trials": 8, "seed": 1, "sampling": "random"}
    words = load({**study, "deviations": {"part_1": data}}, model=toy).deviating.words
    found = [
        float(x)
        for x in re.findall(r"(?:mean|sigma|median) ([\d.]+) mm", words["part_1"])
    ]
    assert found == pytest.approx([rows.mean(), rows.std(), np.median(rows)], rel=0.03)
    assert "sigma of the natural logarithm 0.5" in words["part_1"]


def warnings(toy, path, text, **instead):
    path.write_text(text)
    study = load(path, model=toy, **instead)
    assert study.notes[: len(study.warnings)] == study.warnings
    return study.warnings


def test_a_study_has_warnings(toy, toy_study):
    text = toy_study.read_text()
    assert warnings(toy, toy_study, text) == ()
    for sampling in ("random", "latin", "sobol", "saltelli"):
        still = f'model = "toy"\ntrials = 9\nseed = 1\nsampling = "{sampling}"\n'
        still += (
            '[deviations]\nangle = { distribution = "constant", value = "1 deg" }\n'
        )
        (warning,) = warnings(toy, toy_study, still, trials=1000)
        assert "all 1000 trials are equal" in warning
        if sampling != "saltelli":
            assert warnings(toy, toy_study, still, trials=1) == ()
    grouped = f'sampling = "saltelli"\n{text}'
    (warning,) = warnings(toy, toy_study, grouped)
    assert "500 groups of 5 trials; give trials = 2500 or more" in warning
    assert "1000 are 200 groups" in warning
    assert warnings(toy, toy_study, grouped, trials=2500) == ()


def test_a_rare_study_states_the_safe_number_of_trials(tmp_path):
    path, names = tmp_path / "rare.toml", [f"L{i}" for i in range(10)]
    links = "".join(
        f'{n} = {{ nominal = "1 mm", tolerance = "+-1 mm" }}\n' for n in names
    )
    path.write_text(
        'model = "dimension_chain"\nsampling = "rare"\ntrials = 5000\nseed = 1\n'
        f'settings.gap = "{" + ".join(names)}"\n[links]\n{links}'
        '[limits]\ngap = "<= 16 mm"\n'
    )
    (warning,) = load(path).warnings
    assert "with 5000 the search may miss a small kind" in warning
    trials = int(re.search(r"trials = (\d+) or more", warning)[1])
    assert trials == 20_000
    assert load(path, trials=trials).warnings == ()
    assert load(path, trials=trials - 1).warnings


@pytest.mark.parametrize(("parts", "trials"), [(3, 20_000), (20, 20_000)])
def test_the_number_of_trials_in_a_refusal_is_enough(tmp_path, parts, trials):
    path, names = tmp_path / "rare.toml", [f"L{i}" for i in range(parts)]
    links = {n: {"nominal": "1 mm", "tolerance": "+-0.3 mm"} for n in names}
    study = {
        "model": "dimension_chain", "sampling": "rare", "seed": 1, "links": links,
        "settings": {"gap": "+".join(names)}, "limits": {"gap": "<= 90 mm"},
    }  # fmt: skip
    until = {"until": "gap p95 +-3 %", "at_most": 9000}
    for given, said in (
        ({"trials": 4999}, f"; {trials} are plenty"),
        ({"trials": until}, f"give one, such as trials = {trials}, or"),
        ({}, f"trials: missing; such as trials = {trials}"),
    ):
        path.write_text(tomli_w.dumps({**given, **study}))
        with pytest.raises(StudyError, match=said):
            load(path)
    path.write_text(tomli_w.dumps({"trials": trials, **study}))
    assert load(path).warnings == ()
