"""Another tolerance changes an entry by one rule, whoever asks for it."""

from __future__ import annotations

import tomllib

import pytest

import tolstat
from tests.answers.allocate.linear_stack import Linear, reciprocal
from tests.answers.remedy.following import halved
from tolstat.answers.allocate.fresh_runs import FreshRuns
from tolstat.deviations.distributions import (
    Lognormal,
    Normal,
    StudentT,
    Tolerance,
    Trapezoidal,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from tolstat.deviations.spread import Shifted
from tolstat.errors import TolstatError
from tolstat.study.distribution_entry import NominalShift
from tolstat.study.study import load

HALF, LAW = Tolerance(-1e-4, 1e-4), {"law": "reciprocal", "at": "+-0.2 mm", "price": 1}
# keys of a link beside its tolerance of +-0.2 mm, and its distribution with +-0.1 mm
KINDS = {
    "normal": ({}, Normal(HALF)),
    "trapezoidal": (
        {"distribution": "trapezoidal", "plateau": "+-0.15 mm"},
        Trapezoidal(HALF, Tolerance(-7.5e-5, 7.5e-5)),
    ),
    "triangular": (
        {"distribution": "triangular", "mode": "80 um"}, Triangular(HALF, 4e-5),
    ),
    "uniform": ({"distribution": "uniform"}, Uniform(HALF)),
    "cpk": ({"cp": 1.5, "cpk": 1.2}, Normal(HALF, cp=1.5, cpk=1.2)),
    "shift": ({"shift": "0.15 mm", "cp": 1.33}, Normal(HALF, cp=1.33, shift=7.5e-5)),
    "clipped": (
        {"distribution": "truncated_normal", "outside": "clipped"},
        TruncatedNormal(HALF, outside="clipped"),
    ),
    "student": (
        {"distribution": "student_t", "degrees_of_freedom": 9}, StudentT(HALF, 9.0),
    ),
    "moved": (
        {"distribution": "triangular", "mode": "0.2 mm", "nominal_shift": "0.3 mm"},
        Shifted(Triangular(HALF, 1e-4), 3e-4),
    ),
}  # fmt: skip


def chain(a, b="+-0.02 mm", **more):
    links = {"a": a, "b": {"nominal": "50 mm", "tolerance": b}}
    return {
        "model": "dimension_chain", "trials": 400, "seed": 1, "links": links,
        "settings": {"gap": "a - b"}, "limits": {"gap": "<= 0.3 mm"}, **more,
    }  # fmt: skip


def edited(study, name, change):
    """The study with one change, loaded."""
    editor = load(study).editor()
    editor.change(name, change)
    return load(tomllib.loads(editor.text))


def same(new, expected):
    """Whether two distributions are the same but for rounding of typed numbers."""
    kinds = {type(expected)} if not isinstance(expected, Shifted) else {Shifted}
    return {type(new)} == kinds and repr(rounded(new)) == repr(rounded(expected))


def rounded(value):
    if isinstance(value, tuple):
        return [round(x, 12) for x in value]
    if isinstance(value, float):
        return round(value, 12)
    return {k: rounded(v) for k, v in vars(value).items()} if hasattr(
        value, "__dict__"
    ) else value  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_answer_gives_the_same_distribution(tmp_path, kind):
    """By the editor, what-if, a fresh study, halving and an allocation."""
    keys, expected = KINDS[kind]
    study = chain({"nominal": "50 mm", "tolerance": "+-0.2 mm", **keys})
    asked = {"a": "+-0.1 mm"}
    assert same(edited(study, "a", asked["a"]).deviating.distributions["a"], expected)
    run = tolstat.run(study, output=tmp_path / "chain.h5")
    fresh = tolstat.fresh_study(run, asked)
    assert same(load(tomllib.loads(fresh)).deviating.distributions["a"], expected)
    link = tomllib.loads(fresh)["links"]["a"]
    assert link.keys() == {"nominal", "tolerance", *keys}
    by_halves = tolstat.fresh_study(run, halved(run, "a"))
    assert tomllib.loads(by_halves)["links"]["a"] == link
    words = link.get("distribution", "normal").replace("_", " ")
    try:
        scenario = tolstat.what_if(run, asked).changes["a"].scenario
    except TolstatError as error:  # too few trials, or parts that are moved far
        assert "effective sample size" in str(error) or "sampled" in str(error)
    else:
        assert scenario.startswith(f"{words}, +-0.1 mm")
    study["links"]["a"]["cost"] = LAW
    priced = load(study)
    runs = FreshRuns(priced, None, 8, lambda progress: None)
    (entry,) = priced.deviating.priced
    choice = (entry.specified_choice - 0.6931471805599453,)
    written = tomllib.loads(runs.study_text(choice))["links"]["a"]
    assert written == {**link, "cost": LAW}
    # a list of tolerances too
    study["links"]["a"]["cost"] = {"+-0.2 mm": 1, "+-0.1 mm": 2}
    (entry,) = load(study).deviating.priced
    assert same(entry.distributions(1.0)["a"], expected)


def test_a_median_lies_as_far_across_the_zone():
    keys = {"distribution": "lognormal", "median": "0.2 mm"}
    study = chain({"nominal": "50 mm", "tolerance": "0.1..0.4 mm", **keys})
    new = edited(study, "a", "0.2..0.8 mm").deviating.distributions["a"]
    assert same(new, Lognormal(Tolerance(2e-4, 8e-4), 4e-4))


def test_a_part_of_a_group_changes_and_the_others_keep_their_entry():
    entry = {"tolerance": "+-1.2 mm", "distribution": "triangular", "mode": "0.6 mm"}
    study = {"model": "stand", "trials": 8, "seed": 1}
    study["deviations"] = {"rod_length": entry, "crank_radius": "+-0.5 mm"}
    editor = load(study).editor()
    editor.change("rod_length_2", "+-0.6 mm")
    deviations = editor.table["deviations"]
    half = {**entry, "tolerance": "+-0.6 mm", "mode": "0.3 mm"}
    one = {"rod_length_1": entry, "rod_length_2": half, "crank_radius": "+-0.5 mm"}
    assert deviations == one
    # and together again, of different entries: each keeps its own distribution
    editor.change("rod_length_1", {"tolerance": "+-1 mm"})
    editor.change("rod_length", "+-0.6 mm")
    assert editor.table["deviations"] == {
        "crank_radius": "+-0.5 mm", "rod_length_1": "+-0.6 mm", "rod_length_2": half,
    }  # fmt: skip
    editor.change("rod_length", entry)
    assert editor.table["deviations"] == study["deviations"]


def test_a_batch_changes_as_a_whole_and_stays_one():
    entry = {"tolerance": "+-1.2 mm", "cp": 1.33, "common": 0.8}
    study = {"model": "stand", "trials": 8, "seed": 1}
    editor = load({**study, "deviations": {"rod_length": entry}}).editor()
    with pytest.raises(TolstatError, match=r"one entry; .* `rod_length = \.\.\.`"):
        editor.change("rod_length_1", "+-0.6 mm")
    editor.change("rod_length", "+-0.6 mm")
    assert editor.table["deviations"] == {
        "rod_length": {**entry, "tolerance": "+-0.6 mm"}
    }
    whole = {"tolerance": "+-0.6 mm", "distribution": "uniform"}
    editor.change("rod_length", whole)
    assert editor.table["deviations"] == {"rod_length": {**whole, "common": 0.8}}


def test_a_cost_stays_where_it_has_a_price():
    link = {"nominal": "50 mm", "tolerance": "+-0.2 mm"}
    offers = {"+-0.2 mm": 1, "+-0.1 mm": 2}
    for cost, priced in ((LAW, True), (offers, False)):
        new = edited(chain({**link, "cost": cost}), "a", "+-0.15 mm")
        assert bool(new.deviating.priced) == priced
    assert edited(chain({**link, "cost": offers}), "a", "+-0.1 mm").deviating.priced


def test_sizes_and_shifts_of_a_link():
    study = chain("50.1 mm", deviations={"b": "+-0.01 mm"})
    study["settings"]["gap"] = "a - b_1"
    study["links"]["b_1"] = "50 mm"
    del study["links"]["b"]
    editor = load(study).editor()
    editor.change("a", "+-0.1 mm")  # it did not deviate
    editor.change("b", "+-0.02 mm")  # its deviation stands elsewhere
    editor.change("a", {"nominal": "50.2 mm"})
    editor.change("a", NominalShift("-0.03 mm"))
    new = load(tomllib.loads(editor.text))
    assert editor.table["links"] == {
        "a": {"nominal": "50.2 mm", "tolerance": "+-0.1 mm",
              "nominal_shift": "-0.03 mm"},
        "b_1": "50 mm",
    }  # fmt: skip
    assert editor.table["deviations"] == {"b": "+-0.02 mm"}
    assert new.deviating.distributions["a"] == Shifted(Normal(HALF), -3e-5)


def test_a_class_of_gears_becomes_a_tolerance_and_a_grade_keeps_its_size():
    weibull = {"distribution": "weibull", "shape": 2}
    entry = {"iso1328": 9, "module": "12 mm", **weibull}
    study = {"model": "stand", "trials": 8, "seed": 1}
    study["deviations"] = {
        "runout_7": entry, "rod_length": {"tolerance": "IT10", "size": "2 m"},
    }  # fmt: skip
    editor = load(study).editor()
    editor.change("runout_7", "0..30 um")
    editor.change("rod_length", "IT9")
    assert editor.table["deviations"] == {
        "runout_7": {"tolerance": "0..30 um", **weibull},
        "rod_length": {"tolerance": "IT9", "size": "2 m"},
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("+-0.1 kN", "of another kind"),
        ({"tolerance": "+-0.1 mm", "distribution": "trapezoidal",
          "plateau": "+-0.15 mm"}, "the plateau lies outside the tolerance"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(change, words):
    study = chain({"nominal": "50 mm", "tolerance": "+-0.2 mm", **KINDS["uniform"][0]})
    with pytest.raises(TolstatError, match=words):
        edited(study, "a", change)


def test_parts_without_a_tolerance_have_none_to_change(tmp_path):
    (tmp_path / "parts.csv").write_text("size [mm]\n49.9\n50\n50.1\n")
    measured = {"nominal": "50 mm", "data": "parts.csv", "column": "size"}
    constant = {"nominal": "50 mm", "distribution": "constant", "value": "0.1 mm"}
    for link, words in ((measured, "measured parts have"), (constant, "a constant")):
        editor = load(chain(link), folder=tmp_path).editor()
        with pytest.raises(TolstatError, match=f"{words}.* give a whole entry"):
            editor.change("a", "+-0.1 mm")
        editor.change("a", {"tolerance": "+-0.1 mm"})
        assert load(editor.table).deviating.distributions["a"] == Normal(HALF)


def test_a_typed_deviation_is_never_read_as_a_size():
    """Friction deviates relative to a nominal value that is not known."""
    study = {"model": "stand", "trials": 8, "seed": 1, "deviations": {}}
    entry = {"tolerance": "+10..+20 %", "distribution": "triangular", "mode": "+12 %"}
    study["deviations"]["friction"] = entry
    new = edited(study, "friction", "+20..+40 %").deviating.distributions["friction"]
    assert same(new, Triangular(Tolerance(0.2, 0.4), 0.24))


def test_changed_entries_keep_their_place():
    """Choices of an allocation are by place: another order would be another choice."""
    listed = {"+-0.1 mm": 1, "+-0.05 mm": 3}
    parts = {f"link_{i}": {"tolerance": "+-0.1 mm", "cost": listed} for i in (1, 2, 3)}
    study = reciprocal() | {"deviations": parts}
    runs = FreshRuns(load(study, model=Linear()), None, 100, None)
    for choice in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 1.0)):
        assert runs.as_written(choice) == choice
    editor = load(study, model=Linear()).editor()
    editor.change("link_1", "+-0.05 mm")
    assert [*editor.table["deviations"]] == [*parts]
