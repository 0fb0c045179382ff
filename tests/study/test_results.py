"""Results from elsewhere: rows of a file are trials, and a run like any other."""

from __future__ import annotations

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy import stats

import tolstat
from tests.cli.command_line import call
from tolstat.errors import DataError, QuestionError, RunFileError, StudyError

ROWS = 2000
STUDY = """\
model = "results"

[table]
data = "DATA"
KEYS

[links]
crank = "50 +-0.1 mm"
rod = "150 +-0.2 mm"
offset = { nominal = "0 mm", tolerance = "+-0.2 mm", distribution = "uniform" }

[responses]
slide = "mm"
force = "kN"

[limits]
slide = "168.4..168.8 mm"
force = "<= 3.05 kN"
"""
SAMPLED = 'sampled = "random"\nfailed = "state"\ndone = "converged"'


def rows(number=ROWS, seed=5):
    """What another program may write: a slider crank at 60 deg."""
    random = np.random.default_rng(seed)
    crank, rod = random.normal(50, 0.1 / 3, number), random.normal(150, 0.2 / 3, number)
    offset = random.uniform(-0.2, 0.2, number)
    phi = np.deg2rad(60)
    slide = crank * np.cos(phi) + np.sqrt(rod**2 - (crank * np.sin(phi) - offset) ** 2)
    force = 3 + 0.4 * (crank - 50) + 0.01 * random.standard_normal(number)
    state = np.where(np.arange(number) % 400 == 7, "diverged", "converged")
    return pd.DataFrame({
        "crank [mm]": crank, "rod [mm]": rod, "offset [mm]": offset,
        "slide [mm]": slide, "force [kN]": force, "state": state,
    })  # fmt: skip


@pytest.fixture
def study(tmp_path):
    def write(table, data="rows.csv", keys=SAMPLED, text=STUDY):
        path = tmp_path / data
        if path.suffix == ".csv":
            table.to_csv(path, index=False)
        elif path.suffix == ".xlsx":
            table.to_excel(path, index=False, engine="xlsxwriter")
        elif path.suffix == ".parquet":
            table.to_parquet(path)
        else:
            with h5py.File(path, "w") as file:
                group = file.create_group("results")
                for head, values in table.items():
                    name, _, unit = head.partition(" [")
                    column = values.to_numpy()
                    column = column if column.dtype.kind == "f" else [*map(str, column)]
                    group[name] = column
                    group[name].attrs["units"] = unit.rstrip("]")
        (tmp_path / "study.toml").write_text(
            text.replace("DATA", data).replace("KEYS", keys)
        )
        return tmp_path / "study.toml"

    return write


@pytest.mark.parametrize("ending", ["csv", "xlsx", "parquet", "hdf5"])
def test_rows_of_any_file_are_the_trials(study, ending):
    table = rows(200)
    run = tolstat.run(study(table, f"rows.{ending}"))
    frame = run.frame()
    assert run.trials == 200 and run.sampling == "table" and run.complete
    done = table["state"] == "converged"
    assert (frame["status"] == "done").tolist() == done.tolist()
    assert run.failures == {"failed elsewhere": 1}
    for name, unit, nominal in (
        ("crank", 1e-3, 50), ("rod", 1e-3, 150), ("offset", 1e-3, 0),
    ):  # fmt: skip
        column = table[f"{name} [mm]"]
        np.testing.assert_allclose(frame[name], unit * (column - nominal), atol=1e-15)
    np.testing.assert_allclose(frame["slide"][done], 1e-3 * table["slide [mm]"][done])
    np.testing.assert_allclose(frame["force"][done], 1e3 * table["force [kN]"][done])
    assert frame["slide"][~done].isna().all()
    assert any("SHA-256" in note and "200 rows" in note for note in run.notes)


def test_statistics_are_those_of_pandas_and_scipy(study):
    table = rows()
    report = tolstat.report(tolstat.run(study(table)))
    done = table[table["state"] == "converged"]
    slide = report.responses["slide"]
    values = 1e-3 * done["slide [mm]"]
    assert slide.mean.value == pytest.approx(values.mean(), rel=1e-12)
    assert slide.sigma.value == pytest.approx(values.std(), rel=1e-9)
    lower, upper = stats.t.interval(0.95, len(values) - 1, values.mean(), values.sem())
    assert slide.mean.lower == pytest.approx(lower, abs=0.02 * (upper - lower))
    out = ~values.between(0.1684, 0.1688)
    failed = len(table) - len(done)
    share = (out.sum() + failed) / len(table)
    estimated = slide.limited.yields.fraction_out_of_limit
    assert estimated.value == pytest.approx(share)
    ranks = [stats.spearmanr(done[f"{n} [mm]"], values)[0] for n in ("rod", "crank")]
    shares = slide.contributions.first_order
    assert shares["rod"].value == pytest.approx(ranks[0] ** 2, abs=0.05)
    assert shares["crank"].value == pytest.approx(ranks[1] ** 2, abs=0.05)


def test_what_if_weights_rows_and_writes_no_study(study, tmp_path):
    run = tolstat.run(study(rows()), output=tmp_path / "run.h5")
    scenario = tolstat.what_if(run, {"rod": "+-0.15 mm"})
    # the ratio of two normal densities, written apart
    rod = run.column("rod")
    ratio = stats.norm.pdf(rod, 0, 0.05e-3) / stats.norm.pdf(rod, 0, 0.2e-3 / 3)
    slide = pd.Series(run.column("slide"))
    out = (run.status != 1) | ~slide.between(0.1684, 0.1688)
    limited = scenario.responses["slide"].scenario.limited
    value = limited.yields.fraction_out_of_limit.value
    assert value == pytest.approx(np.average(out, weights=ratio), rel=0.02)
    with pytest.raises(QuestionError, match="rows of a file"):
        tolstat.fresh_study(run, {"rod": "+-0.1 mm"})


def test_an_input_without_a_tolerance_contributes(study):
    text = STUDY.replace('rod = "150 +-0.2 mm"', 'rod = "150 mm"')
    run = tolstat.run(study(rows(), text=text))
    assert "rod" in tolstat.report(run).responses["slide"].contributions.first_order
    with pytest.raises(StudyError, match="its distribution is not known"):
        tolstat.what_if(run, {"rod": "+-0.1 mm"})


def test_rows_without_inputs_are_judged(study):
    text = STUDY[: STUDY.index("[links]")] + STUDY[STUDY.index("[responses]") :]
    run = tolstat.run(study(rows()[["slide [mm]", "force [kN]", "state"]], text=text))
    assert not run.contributors
    assert tolstat.report(run).responses["slide"].mean.sure


@pytest.mark.parametrize(
    ("said", "unknown"),
    [("", True), ('sampled = "unknown"', True), ('sampled = "grid"', False)],
)  # fmt: skip
def test_rows_of_unknown_origin_have_no_statistics(study, said, unknown):
    keys = f'{said}\nfailed = "state"\ndone = "converged"'
    run = tolstat.run(study(rows(100), keys=keys))
    assert run.sampled is None
    assert unknown == any("does not say how" in text for text in run.warnings)
    extremes = tolstat.report(run)
    least = extremes.responses["slide"].least.value
    assert least == np.nanmin(run.column("slide"))
    with pytest.raises(QuestionError, match="how its rows were sampled"):
        tolstat.compare(run, run)


def test_a_hypercube_is_taken_as_random_rows(study):
    run = tolstat.run(study(rows(), keys=SAMPLED.replace("random", "latin")))
    assert run.sampled and "Latin hypercube" in run.sampled.promise
    assert tolstat.report(run).responses["slide"].mean.sure


def changed(head, row, value):
    table = rows(100)
    table[head] = table[head].astype(object)
    table.loc[row, head] = value
    return table


@pytest.mark.parametrize(
    ("table", "keys", "words"),
    [
        (changed("slide [mm]", 3, ""), SAMPLED, "line 5, column slide: '' is"),
        (changed("slide [mm]", 3, "nan"), SAMPLED, "line 5, column slide: 'nan' is"),
        (changed("slide [mm]", 3, "ERR"), SAMPLED, "line 5, column slide: 'ERR' is"),
        (changed("rod [mm]", 7, ""), SAMPLED, "line 9, column rod: '' is"),
        (rows(100), 'failed = "state"', "line 2, column state: 'converged' may be"),
        (rows(100), 'done = "ok"', "it needs failed"),
        (rows(100), 'failed = "stat"', "has no column 'stat'"),
        (rows(1), SAMPLED, "1 row; trials are 2"),
        (rows(100).drop(columns="force [kN]"), SAMPLED, "no column 'force'"),
        (rows(100).rename(columns={"rod [mm]": "rod [kN]"}), SAMPLED, "column rod"),
        (rows(100), 'columns = { rood = "x" }', "rood"),
        (rows(100), 'sampled = "plain"', "one of random, latin, grid, unknown"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_said_with_its_place(study, table, keys, words):
    with pytest.raises((StudyError, DataError)) as error:
        tolstat.run(study(table, keys=keys))
    assert words in str(error.value)


def test_what_is_doubtful_is_said_before_the_verdict(study):
    table = rows(400)
    table.loc[30, "offset [mm]"] = 0.5
    table["note"] = 1.0
    table["rod [mm]"] = 150 + 3 * (table["rod [mm]"] - 150)
    run = tolstat.run(study(table))
    words = "\n".join(run.warnings)
    assert "line 32: offset is 0.5 mm, outside its tolerance" in words
    assert "no entry names the column note" in words
    assert "rod: the rows are not distributed as stated" in words
    assert "line 2:" in words or "rod is" in words  # far more than 0.27 % outside
    assert "crank: the rows" not in words


def test_a_column_in_another_unit_than_its_limit_is_said(study):
    table = rows(400).rename(columns={"force [kN]": "force"})
    table["force"] /= 1000  # MN
    run = tolstat.run(study(table))
    (far,) = tolstat.summary(run).warnings
    assert (far.kind, far.response, far.end) == ("far limit", "force", 3050)
    table.loc[::2, "force"] *= 1000
    mixed = tolstat.run(study(table), force=True)
    assert "column force: 200 rows are 1000 times as large" in mixed.warnings[0]


def test_copies_of_rows_are_refused_unless_they_are_units(study):
    table = rows(400)
    table.loc[[50, 60]] = table.loc[[20, 21]].to_numpy()
    with pytest.raises(StudyError, match="line 52 has the same numbers as line 22, and "
                       "62 repeat others"):  # fmt: skip
        tolstat.run(study(table))
    run = tolstat.run(study(table, keys=SAMPLED + "\nrepeats = true"))
    assert run.trials == 400 and run.warnings == ()
    grid = SAMPLED.replace("random", "grid")  # no sample: nothing rests on it
    assert (
        "counts twice" in tolstat.run(study(table, keys=grid), force=True).warnings[0]
    )


def test_rounded_rows_agree_by_chance(study):
    """Parts of a fifth of sigma: 1500 rows of three inputs agree in dozens of pairs."""
    table = rows(1500).round({"crank [mm]": 2, "rod [mm]": 2, "offset [mm]": 1})
    table["slide [mm]"] = table["crank [mm]"] + 118.6
    table["force [kN]"] = 3.0 + 0.4 * (table["crank [mm]"] - 50)
    assert table.duplicated().sum() > 20
    tolstat.run(study(table))


@pytest.mark.parametrize("code", ["-999", "9.9e37", "99999.0"])
def test_codes_for_no_value_are_refused_or_named(study, code):
    table = changed("slide [mm]", 3, code)
    table.loc[9, "slide [mm]"] = code
    with pytest.raises(StudyError) as error:
        tolstat.run(study(table))
    for words in (
        "line 5, column slide",
        "also in 11",
        f"no_value = [{float(code):.10g}",
    ):
        assert words in str(error.value)
    run = tolstat.run(study(table, keys=SAMPLED + f"\nno_value = [{code}]"), force=True)
    assert run.failures == {"failed elsewhere": 3}  # with one that did not converge
    assert np.isnan(run.column("slide")[[3, 9]]).all()
    taken = tolstat.run(study(table, keys=SAMPLED + "\nno_value = []"), force=True)
    assert taken.column("slide")[3] == pytest.approx(1e-3 * float(code))


def test_a_shipped_study_takes_the_values_of_one_bore(tmp_path):
    cells = pd.read_csv("runs/bores.csv", sep=";", index_col="id")
    sizes = cells.loc["Bore 1", "actual [mm]"].loc[lambda actual: actual != -999]
    run = tolstat.run("runs/bores.toml", trials=2000, output=tmp_path / "bores.h5")
    bores = np.unique(run.column("bore"))
    np.testing.assert_allclose(bores, 1e-3 * (np.unique(sizes) - 20), atol=1e-12)


def test_good_rows_have_no_warnings(study):
    assert tolstat.run(study(rows(4000))).warnings == ()


def test_correlated_inputs_are_said_unless_the_study_states_them(study):
    table = rows()
    table["crank [mm]"] = 50 + (table["rod [mm]"] - 150) / 2
    assert any("rank correlation" in w for w in tolstat.run(study(table)).warnings)
    text = STUDY + "\n[correlation]\ncrank = { rod = 0.999 }\n"
    run = tolstat.run(study(table, text=text), force=True)
    assert not any("rank correlation" in w for w in run.warnings)


@pytest.mark.parametrize(
    ("stated", "warned"), [(0.6, False), (0.2, True), (-0.6, True)]
)
def test_a_stated_correlation_is_that_of_the_rows(study, stated, warned):
    table = rows()
    score = (table["rod [mm]"] - 150) / (0.2 / 3)
    r = 2 * np.sin(
        np.pi * 0.6 / 6
    )  # of normal deviations with a rank correlation of .6
    other = (table["crank [mm]"] - 50) / (0.1 / 3)
    table["crank [mm]"] = 50 + 0.1 / 3 * (r * score + np.sqrt(1 - r**2) * other)
    text = STUDY + f"\n[correlation]\ncrank = {{ rod = {stated} }}\n"
    words = tolstat.run(study(table, text=text)).warnings
    assert warned == any(f"in the rows, {stated:g} in the study" in w for w in words)


def test_heads_and_units_by_keys(study):
    table = rows(100).rename(columns={"force [kN]": "F max", "slide [mm]": "slide"})
    table["slide"] *= 1.0
    keys = SAMPLED + '\ncolumns = { force = "F max" }'
    run = tolstat.run(study(table, keys=keys))
    assert run.column("force")[0] == pytest.approx(1e3 * table["F max"][0])
    assert run.column("slide")[0] == pytest.approx(1e-3 * table["slide"][0])
    keys = SAMPLED + '\ncolumns = { force = "F max [N]" }'  # the file has no unit
    again = tolstat.run(study(table, keys=keys), force=True)
    assert again.column("force")[0] == pytest.approx(table["F max"][0])
    keys = SAMPLED + '\ncolumns = { force = "F max" }'
    table["slide"] /= 1000  # in the head, another unit of the same kind
    table = table.rename(columns={"slide": "slide [m]"})
    again = tolstat.run(study(table, keys=keys), force=True)
    assert again.column("slide")[0] == pytest.approx(run.column("slide")[0])


def test_a_run_is_verified_replayed_resumed_and_extended(study, tmp_path):
    table = rows()
    path = study(table[:1500])
    run = tolstat.run(path)
    check = tolstat.verify(run.path)
    assert check.whole and check.file == "as stored" and len(check.evaluated) == 1500
    assert tolstat.replay(run, 12).differences == ()
    with pytest.raises(RunFileError, match="runs all rows of its file, 1500 rows"):
        tolstat.extend(run.path, 2000)
    study(table)
    longer = tolstat.extend(run.path, 2000)
    assert longer.trials == 2000 and longer.complete
    assert any("2000 rows" in note for note in longer.notes)
    assert not any("1500 rows" in note for note in longer.notes)
    whole = tolstat.run(path, output=tmp_path / "whole.h5")
    pd.testing.assert_frame_equal(longer.frame(), whole.frame())
    with pytest.raises((RunFileError, StudyError), match="extended"):
        tolstat.decide(run.path)


def test_a_changed_file_is_found(study):
    table = rows(500)
    run = tolstat.run(study(table))
    study(table.assign(note=1))  # other bytes, the same numbers
    check = tolstat.verify(run.path)
    assert check.whole and check.file.startswith("another file")
    table.loc[3, "slide [mm]"] += 1e-9
    study(table)
    check = tolstat.verify(run.path)
    assert [*check.different] == [3] and not check.whole
    study(rows(600).assign(**{"slide [mm]": 168.5}))
    with pytest.raises(RunFileError, match="responses of trials"):
        tolstat.extend(run.path, 600)


def test_two_tables_of_the_same_inputs_are_paired(study, tmp_path):
    table = rows()
    first = tolstat.run(study(table), output=tmp_path / "a.h5")
    stiffer = table.assign(**{"force [kN]": table["force [kN]"] - 0.01})
    second = tolstat.run(study(stiffer), output=tmp_path / "b.h5")
    third = tolstat.run(study(rows(seed=6)), output=tmp_path / "c.h5")
    kinds = [
        tolstat.compare(first, other).differences[0].pairing.kind
        for other in (second, third)
    ]
    assert kinds == ["same trials", "unpaired"]


def test_the_model_alone_has_no_answers():
    links = {"links": {"rod": {"nominal": (0.15, "m")}}}
    frame = tolstat.evaluate("results", {"rod": [0.0, 1e-4]}, links)
    assert [*frame["status"]] == ["not in the file"] * 2


def test_a_new_study_runs_beside_its_file(tmp_path):
    (tmp_path / "new.toml").write_text(tolstat.new_study("results"))
    table = rows(60).rename(columns={"slide [mm]": "stroke [mm]"})
    table[["rod [mm]", "stroke [mm]"]].to_csv(tmp_path / "results.csv", index=False)
    run = tolstat.run(tmp_path / "new.toml")
    assert run.counts["done"] == 60 and not run.warnings


def test_other_samplings_cases_and_missing_responses_are_refused(study):
    for before, after, words in (
        ("model", 'sampling = "random"\nmodel', "rows of a file"),
        ("model", "trials = 7\nmodel", "leave it out"),
        ('[responses]\nslide = "mm"\nforce = "kN"\n', "", "[responses] is missing"),
        ("[links]", "[cases]\nhot = { rod = '151 mm' }\n[links]", "leave out [cases]"),
    ):
        with pytest.raises(StudyError) as error:
            tolstat.run(study(rows(50), text=STUDY.replace(before, after, 1)))
        assert words in str(error.value)


def test_the_command_line(study, tmp_path):
    path = study(rows())
    assert call("run", path).exit_code == 0
    run = path.with_suffix(".h5")
    assert call("report", run, "-o", tmp_path / "page.html").exit_code == 0
    shown = call("what-if", run, "rod=+-0.15 mm", "--write", tmp_path / "w.toml")
    assert shown.exit_code == 2 and "no study samples others" in shown.stderr
    assert call("check", run).exit_code == 3
    assert call("allocate", path).exit_code == 2
    verified = call("verify", run)
    assert verified.exit_code == 0 and "file of the rows: as stored" in verified.stdout


def test_a_column_of_states_that_no_key_names_is_refused(study):
    table = rows(400)
    with pytest.raises(StudyError) as error:
        tolstat.run(study(table, keys='sampled = "random"'))
    counts = "column state has 'converged' (399), 'diverged' (1)"
    assert counts in str(error.value)
    assert 'give failed = "state" and done = ' in str(error.value)
    run = tolstat.run(study(table, keys='sampled = "random"\nfailed = ""'))
    assert counts in "\n".join(run.warnings)
