"""The commands as a user types them."""

from __future__ import annotations

import io
import json
import re
import shlex
import subprocess

import h5py
import pandas as pd
import pytest
from click.testing import CliRunner

import tolstat
from tests.cli.command_line import TOLSTAT, call, chain
from tests.conftest import mill_text
from tests.render.made_tables import table
from tolstat.answers.sweep.extremes_document import table_rows
from tolstat.cli.main import FILES, main
from tolstat.document.blocks import Column
from tolstat.render.screen import UNBOUNDED, Screen, as_text, show_table


def test_help_and_version():
    assert "Monte Carlo tolerance analysis" in call("--help").output
    assert "--workers" in call("run", "--help").output
    assert "tolstat" in call("--version").output


def test_models_and_one_of_them():
    assert "stand" in call("models").output
    shown = call("show", "stand").output
    for word in (
        "crank_speed",
        "rod_length_1",
        "extra_loss",
        "jam_share",
        "geometry",
        "rad/s",
    ):
        assert word in shown
    wrong = call("show", "stnad")
    assert wrong.exit_code == 2 and "did you mean 'stand'" in wrong.stderr


def test_run_show_and_refusal(small_study):
    done = call("run", small_study, "--workers", 1)
    assert done.exit_code == 0, done.output
    for word in ("extra_loss", "<= 3 %", "0 of 24 trials failed", "95 %", "kN"):
        assert word in done.output
    again = call("run", small_study)
    assert again.exit_code == 2 and "--force" in again.stderr
    table = [line for line in done.stdout.splitlines() if "shaft_9_moment" in line]
    shown = call("show", small_study.with_suffix(".h5")).stdout
    assert [line for line in shown.splitlines() if "shaft_9_moment" in line] == table
    assert call("show", "runs/nothing.h5").exit_code == 2
    study = call("show", small_study)
    assert study.exit_code == 2 and "is a study" in study.stderr


@pytest.mark.parametrize(
    "arguments", [["run"], ["run", "x.toml", "--trials", "0"], ["fly"]]
)
def test_wrong_usage(arguments):
    assert call(*arguments).exit_code == 2


def test_the_installed_command(tmp_path):
    found = subprocess.run(
        [TOLSTAT, "run", chain(tmp_path, "few"), "--trials", "8"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    assert "stored in" in found.stderr


def test_a_trial_again(small_study, small_run, tmp_path):
    run, picture = small_run, tmp_path / "trial.svg"
    shown = call("trial", run, 5, "--plot", picture)
    assert shown.exit_code == 0, shown.output
    for word in (
        "trial 5",
        "done",
        "rod_length_1",
        "<= 130 kN",
        "bit for bit as stored",
    ):
        assert word in shown.output
    assert picture.read_text().startswith("<?xml")
    nominal = call("trial", run, "--nominal").output
    assert "nominal trial" in nominal and "bit for bit as stored" in nominal
    with h5py.File(run, "r+") as file:
        file["yaw"][5] *= 2
    changed = call("trial", run, 5)
    assert changed.exit_code == 1
    assert "not bit for bit as stored; different: yaw" in changed.output
    assert "trials 0 to 23" in call("trial", run, 24).stderr
    assert "ends in .png" in call("trial", run, 5, "--plot", "x.gif").stderr
    for arguments in ([run], [run, 5, "--nominal"], [small_study, 5]):
        assert call("trial", *arguments).exit_code == 2


def test_the_nominal_trial_of_a_study(small_study, tmp_path):
    picture = tmp_path / "nominal.png"
    shown = call("trial", small_study, "--nominal", "--plot", picture)
    assert shown.exit_code == 0, shown.output
    assert "103.3 kN" in shown.output and picture.stat().st_size > 20_000


def test_a_trial_that_has_not_run(small_run):
    with h5py.File(small_run, "r+") as file:
        file["status"][3] = 0
    assert "trial 3 has not run" in call("trial", small_run, 3).stderr


def test_a_grid_is_shown_as_curves(tmp_path):
    done = call("run", "runs/khpt75-fig4.toml", "-o", tmp_path / "fig4.h5")
    assert "in trial" in done.stdout and "31 of 61" in done.stdout
    assert "paper's Fig. 4" in done.stdout
    picture = tmp_path / "fig4.png"
    shown = call("show", tmp_path / "fig4.h5", "--plot", picture)
    assert shown.exit_code == 0 and picture.exists()
    assert "reference" in shown.stdout and "1.215" in shown.stdout
    assert call("show", tmp_path / "fig4.h5", "--response", "yaw").exit_code == 2
    two = call("show", tmp_path / "fig4.h5", "stand").stdout
    assert "Fig. 4" in two and "crank_speed" in two


def test_commands_offered_for_a_grid_without_limits_work(tmp_path):
    study = tmp_path / "two.toml"
    study.write_text(
        'model = "stand"\nsampling = "grid"\n[settings]\ncycles = 1\n[grid]\n'
        'crank_difference = ["0 mm", "1 mm"]\ncontact_yaw = ["geometry", "fig4"]\n'
    )
    assert call("run", study).exit_code == 0
    refused = call("compare", study.with_suffix(".h5"), study.with_suffix(".h5"))
    assert refused.exit_code == 2
    (typed,) = re.findall("`tolstat ([^`]*)`", refused.stderr)
    drawn = call(*shlex.split(typed))
    assert drawn.exit_code == 0, drawn.output
    assert study.with_suffix(".png").exists()


def test_warnings_are_printed_before_a_run(tmp_path):
    path = tmp_path / "few.toml"
    head = 'model = "stand"\ntrials = 12\nseed = 1\n'
    few = 'sampling = "saltelli"\n[deviations]\ncrank_difference = "+-1 mm"\n'
    for text, words in (
        (head, "nothing deviates: all 12 trials are equal"),
        (head + few, "they need 500 groups of 3 trials; give trials = 1500 or more"),
    ):
        path.write_text(text)
        done = call("run", path, "--force")
        assert done.exit_code == 0, done.output
        assert done.stderr.startswith("note: ") and words in done.stderr
        assert words in " ".join(done.stdout.split())
        shown = call("show", path.with_suffix(".h5")).stdout
        assert words in " ".join(shown.split())


@pytest.fixture
def table_study(tmp_path):
    """Five stands of a table; the third cannot be mounted."""
    (tmp_path / "machines.csv").write_text(
        "rod_length_1 [mm],crank_difference [mm]\n1.1,0\n-1,0.2\n1200,0\n0,3\n0,1\n"
    )
    path = tmp_path / "five.toml"
    path.write_text(
        'title = "five"\nmodel = "stand"\nsampling = "table"\n'
        'table = "machines.csv"\n[deviations]\n'
        'friction = { distribution = "constant", value = "5 %" }\n'
        '[limits]\nrod_force = "<= 110 kN"\nextra_loss = "<= 3 %"\n'
    )
    return path


def test_the_trials_of_a_table_are_listed(table_study):
    assert call("run", table_study).exit_code == 0
    run = table_study.with_suffix(".h5")
    shown = call("show", run).stdout
    listed = shown[shown.index("five: trials") :].splitlines()
    names = "rod_length_1 crank_difference extra_loss rod_force_1 rod_force_2"
    assert listed[2].split() == names.split()
    units = "trial mm mm % kN kN status out of limit"
    assert listed[3].split() == units.split()
    rows = {line.split()[0]: line.split()[1:] for line in listed[5:10]}
    assert list(rows) == ["0", "1", "2", "3", "4"]
    assert rows["0"][:2] == ["1.1", "0"] and rows["0"][-1] == "done"
    assert rows["3"][1] == "3" and rows["3"][-3:] == [
        "done",
        "extra_loss,",
        "rod_force_1",
    ]
    assert rows["2"][2:] == ["failed"] * 3 + ["does", "not", "fit"]
    assert "in all trials: friction 5 %" in shown
    with h5py.File(run, "r+") as file:
        file["status"][4] = 0
    refused = call("show", run)
    assert refused.exit_code == 1 and "is damaged: trials 4;" in refused.stderr
    listed, *_ = table_rows(tolstat.open(run, damaged=True))
    assert [as_text(cell.main) for cell in listed.rows[-1][-2:]] == ["not run", ""]


def test_a_shortened_table_is_marked(table_study):
    rows = "".join(f"{0.01 * i},0\n" for i in range(50))
    machines = table_study.with_name("machines.csv")
    machines.write_text("rod_length_1 [mm],crank_difference [mm]\n" + rows)
    assert call("run", table_study).exit_code == 0
    shown = " ".join(call("show", table_study.with_suffix(".h5")).stdout.split())
    assert "the first 40 of 50 trials" in shown and ".frame()" in shown
    assert " 39 0.39 " in shown and " 40 0.4 " not in shown


def numbers_of(text):
    """Every number that is printed, ends of intervals by themselves."""
    plain = re.sub(r"\x1b\[[\d;]*m", "", text).replace("..", " ")
    return set(re.findall(r"-?\d[\w.+-]*", plain)), plain


@pytest.mark.parametrize("columns", [80, 60, 30])
def test_a_narrow_terminal_loses_no_digit(small_as_run, monkeypatch, columns):
    run = small_as_run
    commands = (["show", run], ["trial", run, 5], ["show", "stand"])
    wide = [numbers_of(call(*command).stdout)[0] for command in commands]
    assert "368" in wide[0]  # trials that the 99 % quantile needs
    # a terminal, as far as rich can tell
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(columns))
    for command, known in zip(commands, wide, strict=True):
        found, text = numbers_of(call(*command).stdout)
        assert "…" not in text
        # columns that find no room are named, and no number is broken
        assert found >= known or "on a wider screen also: " in text, known - found
        assert found <= known | {"0.135", "99.865"}, found - known
        if columns >= (60 if command[1] == run else 80):
            lines = [x for x in text.splitlines() if not x.startswith("     /")]
            assert max(map(len, lines)) <= columns  # but a word of a command
    shown = numbers_of(call("show", run).stdout)[1]
    if columns < 80:
        assert "\n  verdict: " in shown and "on a wider" not in shown
    else:
        assert "on a wider screen also: equivalent Ppk\n" in shown


def test_a_terminal_of_any_width_takes_no_memory(monkeypatch):
    monkeypatch.setenv("COLUMNS", str(10**9))
    assert Screen().width == UNBOUNDED


def test_a_title_uses_the_width_of_the_screen(capsys):
    title = "of a chain: 200000 trials of dimension_chain"
    show_table(table(["response"], [["gap"]], title))
    show_table(table(["response", Column("", words=True)], [["gap", "1 mm"]], title))
    assert capsys.readouterr().out.count(f"{title}\n") == 2


def test_sobol_runs_state_the_method_of_their_intervals(tmp_path):
    study = chain(tmp_path, "sobol", trials=512)
    unlimited = study.read_text().partition("[limits]")[0]
    study.write_text(f'sampling = "sobol"\n{unlimited}')
    shown = call("run", study).stdout
    assert "Sobol' trials depend on each other" in shown
    assert "16 independent scrambles" in shown
    assert "needs 3000" in shown  # the 99 % quantile of every replicate


def test_a_yield_can_be_demanded(tmp_path):
    study = chain(tmp_path, "demanded", trials=64)
    demanded = '{ limit = ">= 0.5 mm", yield = "90 %" }'
    study.write_text(study.read_text().replace('">= 0.5 mm"', demanded))
    lines = call("run", study).stdout.splitlines()
    (at, *_) = [i for i, line in enumerate(lines) if ">= 0.5 mm" in line]
    assert "for 90 %" in lines[at + 1] and "99.73 %" not in lines[at + 1]


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    """The main study and its twin, 60 trials each."""
    folder = tmp_path_factory.mktemp("twins")
    paths = []
    for name in ("khpt75", "khpt75-equalized"):
        paths.append(folder / f"{name}.h5")
        study = paths[-1].with_suffix(".toml")
        study.write_text(mill_text(name))
        done = call("run", study, "--trials", 60)
        assert done.exit_code == 0, done.output
    return paths


def test_report_as_a_page_and_for_other_tools(twins, tmp_path):
    run = twins[0]
    done = call("report", run)
    assert done.exit_code == 0 and "report in" in done.output
    page = run.with_suffix(".html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "Verdict" in page
    named = tmp_path / "named.html"
    assert call("report", run, "-o", named, "--response", "yaw").exit_code == 0
    assert '<h2 id="yaw">' in named.read_text()
    found = json.loads(call("report", run, "--json").stdout)
    assert found["trials"]["done"] == 60
    assert len(found["responses"]["rod_force_1"]["worst_trials"]) == 10
    table = tmp_path / "numbers.csv"
    assert call("report", run, "--csv", "-o", table).exit_code == 0
    assert "mean [unit],mean lower [unit]," in table.read_text()


@pytest.mark.parametrize("both", [("--json", "--csv"), ("--csv", "--json")])
def test_numbers_are_written_in_one_form(twins, both):
    done = call("report", twins[0], *both)
    assert done.exit_code == 2 and "give --json or --csv, not both" in done.stderr
    assert done.stdout == ""


def test_a_refused_report_has_a_reason(twins, tmp_path):
    for arguments, words in (
        (("runs/khpt75.toml",), "is a study"),
        ((tmp_path / "none.h5",), "no such file"),
        ((twins[0], "--response", "jaw"), "did you mean 'yaw'"),
        ((twins[0], "-o", tmp_path / "no" / "page.html"), "cannot be written"),
    ):
        done = call("report", *arguments)
        assert done.exit_code == 2 and words in done.stderr, done.output


def test_compare_on_the_screen_and_as_a_page(twins, tmp_path, monkeypatch):
    with monkeypatch.context() as wide:
        wide.setenv("FORCE_COLOR", "1")  # a terminal, as far as rich can tell
        done = call("compare", *twins)
    assert done.exit_code == 0
    for words in (
        "B less A",
        "smaller in B, %",
        "60 of 60",
        "variant: indeterminate -> equalized",
    ):
        assert words in done.output
    page = tmp_path / "twins.html"
    assert call("compare", *twins, "-o", page).exit_code == 0
    assert "trial by trial" in page.read_text()
    (found,) = json.loads(call("compare", *twins, "--json").stdout)["differences"]
    assert found["responses"]["extra_loss"]["smaller"]["value"] > 0.9
    table = pd.read_csv(io.StringIO(call("compare", *twins, "--csv").stdout))
    assert list(table["response"]) == list(found["responses"])
    row, yaw = table.set_index("response").loc["yaw"], found["responses"]["yaw"]
    times = {"mrad": 1e3, "urad": 1e6, "rad": 1}[row["unit"]]
    more = row["second less first: mean upper [unit]"]
    assert more == pytest.approx(times * yaw["mean"]["upper"], rel=1e-9)
    smaller = row["smaller in second lower [%]"]
    assert smaller == pytest.approx(100 * yaw["smaller"]["lower"])
    row, loss = table.set_index("response").loc["extra_loss"], found["responses"]
    known = loss["extra_loss"]["limit"]
    assert row["worse"] == known["worse"] and row["better"] == known["better"]
    more = row["second less first: fraction out of limit lower [ppm]"]
    assert more == pytest.approx(
        1e6 * known["fraction_out_of_limit_difference"]["lower"]
    )


def test_several_runs_are_compared_with_the_first(twins, tmp_path):
    other, page = tmp_path / "other.h5", tmp_path / "three.html"
    asked = ("--trials", 40, "--seed", 76, "-o", other)
    assert call("run", twins[1].with_suffix(".toml"), *asked).exit_code == 0
    done = call("compare", *twins, other, "-o", page)
    assert done.exit_code == 0
    said = " ".join(done.output.split())
    assert "60 trials done, 0 failed" in said and "same trials (every" in said
    assert "40 trials done, 0 failed" in said
    assert "unpaired (seeds 75 and 76)" in said
    assert "C less A" in page.read_text()
    found = json.loads(call("compare", *twins, other, "--json").stdout)["differences"]
    assert [each["pairing"]["kind"] for each in found] == ["same trials", "unpaired"]
    two = json.loads(call("compare", *twins, "--json").stdout)
    assert found[:1] == two["differences"]
    table = pd.read_csv(io.StringIO(call("compare", *twins, other, "--csv").stdout))
    assert list(table["pairing"].unique()) == ["same trials", "unpaired"]
    assert len(table) == sum(len(each["responses"]) for each in found)


def test_one_run_alone_is_not_compared(twins):
    done = call("compare", twins[0])
    assert done.exit_code == 2 and "two runs or more" in done.stderr


def test_a_run_until_precise_reports_it(tmp_path):
    study = chain(tmp_path, "until", limit=">= 1 mm")
    text = study.read_text()
    rule = 'trials = { until = "gap median +-1 %", at_most = 3000 }'
    study.write_text(text.replace("trials = 1000", rule))
    done = call("run", study)
    assert done.exit_code == 0 and "not met" in done.output
    assert "0 of 1024 trials failed" in done.output
    reached = "gap median +-1 %: reached, checked after 1024 trials"
    assert reached in done.output
    rule = 'trials = { until = "gap mean +-0.1 %", at_most = 1100 }'
    study.write_text(text.replace("trials = 1000", rule))
    done = call("run", study, "--force")
    said = " ".join(done.stderr.split())
    assert "+-0.1 %: about" in said
    assert "needed (first estimate); at_most = 1100 is probably too small" in said
    assert "not reached" in done.output


@pytest.mark.parametrize("command", ["compare {0} {0} -o {1}", "report {0} -o {1}"])
def test_a_reader_that_ends_early_loses_no_file(small_as_run, tmp_path, command):
    """As `| head -1`: the reader has ended before anything is written."""
    page = tmp_path / "page.html"
    words = command.format(small_as_run, page).split()
    with subprocess.Popen(
        [TOLSTAT, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        said = process.stderr.read()
    assert process.returncode == 0 and said == "" and "</html>" in page.read_text()


def test_a_run_whose_reader_ends_is_judged(tmp_path):
    study = chain(tmp_path, "missed", limit=">= 1.2 mm")
    with subprocess.Popen(
        [TOLSTAT, "run", study, "--check"], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        process.stdout.close()
        said = process.stderr.read()
    assert process.returncode == 3 and "Traceback" not in said
    assert tolstat.open(study.with_suffix(".h5")).complete


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_no_line_is_longer_than_columns(small_as_run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    wrong = small_as_run.with_name("wrong.toml")
    wrong.write_text('model = "stand"\nrod_length = "+-1 mm"\ntrails = 8\nseed = 1\n')
    commands = ["show", small_as_run], ["run", wrong], ["compare", *[small_as_run] * 2]
    for command in commands:
        done = call(*command)
        lines = [
            x for x in done.output.splitlines() if str(small_as_run.parent) not in x
        ]
        assert lines and max(map(len, lines)) <= columns, command


def test_the_list_of_commands_has_a_line_for_each():
    done = CliRunner().invoke(main, ["--help"], terminal_width=80)
    listed = done.output.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
    assert [line.split()[0] for line in listed] == [*FILES]
    assert all(line.endswith(".") and "..." not in line for line in listed)
