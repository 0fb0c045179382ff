"""Other words of the field lead to the name that is meant."""

import dataclasses

import pytest
from click.testing import CliRunner

from tolstat.cli.main import FILES, main
from tolstat.deviations.distributions import DISTRIBUTIONS
from tolstat.deviations.draw import SAMPLERS
from tolstat.errors import TolstatError, allowed_names
from tolstat.machines.dimension_chain.declarations import Settings
from tolstat.machines.dimension_chain.formula import FUNCTIONS
from tolstat.study.distribution_entry import OF_THE_TOLERANCE
from tolstat.study.sampling import GIVEN
from tolstat.study.study import load
from tolstat.study.study_schema import TITLE_KEYS, Document, LimitEntry
from tolstat.synonyms import _WORDS

KEYS = {f.name for kind in DISTRIBUTIONS.values() for f in dataclasses.fields(kind)}
SETTINGS = {f.name for f in dataclasses.fields(Settings)} | {"rtol", "max_step"}
SAMPLINGS = [*SAMPLERS, *GIVEN]
MEANT = [
    ("rectangular", "uniform"), ("gauss", "normal"), ("Gaussian", "normal"),
    ("norm", "normal"), ("log-normal", "lognormal"), ("triangle", "triangular"),
    ("trapezoid", "trapezoidal"), ("rayleigh", "weibull"), ("exponential", "weibull"),
    ("equal", "uniform"), ("fixed", "constant"), ("const", "constant"),
    ("truncated", "truncated_normal"), ("NORMAL", "normal"), ("unifrom", "uniform"),
    ("Student", "student_t"), ("t", "student_t"), ("student-t", "student_t"),
]  # fmt: skip


def test_each_name_that_is_proposed_exists():
    every = {*DISTRIBUTIONS, *KEYS, *OF_THE_TOLERANCE, *SAMPLINGS, *FILES, *FUNCTIONS}
    every |= {*Document.model_fields, *TITLE_KEYS, *LimitEntry.model_fields, *SETTINGS}
    every |= {"distribution", "common", "cost", "data", "nominal", "**"}
    proposed = {name.partition(",")[0] for names in _WORDS.values() for name in names}
    assert proposed <= every


def test_no_word_of_the_field_is_written_in_a_form_that_is_never_looked_up():
    words = [word for several in _WORDS for word in several]
    assert [w for w in words if w != w.casefold() or {*w} & {*"- ."}] == []


@pytest.mark.parametrize(("word", "name"), MEANT)
def test_distributions(word, name):
    assert allowed_names(word, DISTRIBUTIONS).startswith(f"did you mean '{name}'")


@pytest.mark.parametrize(
    ("entry", "name"),
    [
        ({"tolerance": "+-1 mm", "distribution": "rectangular"}, "'uniform'?"),
        ({"distribution": "rayleigh"}, "'weibull', with shape = 2?"),
        ({"tolerance": "+-1 mm", "std": "0.3 mm"}, "'sigma'?"),
        ({"tolerance": "+-1 mm", "mu": "0.3 mm"}, "'mean'?"),
        ({"tolerance": "+-1 mm", "bias": "0.3 mm"}, "'shift' or 'nominal_shift'"),
        ({"tol": "+-1 mm"}, "'tolerance'?"),
        ({"distribution": "student_t", "dof": 9}, "'degrees_of_freedom'?"),
        ({"tolerance": "+-1 mm", "dist": "normal"}, "'distribution'?"),
        ({"tolerance": "+-1 mm", "Cpk": 1.33}, "'cpk'?"),
        ({"tolerance": "+-1 mm", "ppk": 1.33}, "'cpk' or 'cp'?"),
    ],
)
def test_keys_of_a_deviation(entry, name):
    study = {"model": "stand", "trials": 8, "seed": 1}
    with pytest.raises(TolstatError) as refused:
        load({**study, "deviations": {"rod_length": entry}})
    assert name in str(refused.value)


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("tolerances", "'deviations' or 'links'"), ("limit", "'limits'"),
        ("link", "'links'"), ("correlations", "'correlation'"), ("n", "'trials'"),
        ("config", "'settings'"), ("random_state", "'seed'"), ("machine", "'model'"),
    ],
)  # fmt: skip
def test_sections_of_a_study(key, name):
    with pytest.raises(TolstatError, match=f"{key}: .*did you mean {name}"):
        load({"model": "stand", "trials": 8, "seed": 1, key: {"yaw": "1 mrad"}})


@pytest.mark.parametrize(
    ("formula", "name"),
    [
        ("arctan(A / B)", "'atan'"), ("ln(A / B)", "'log'?"), ("arcsin(A/B)", "'asin'"),
        ("log10(A / B)", "'log', as log(x) / log(10)"), ("pow(A, 2)", "such as a**2"),
        ("np.hypot(A, B)", "'hypot'"), ("maximum(A, B)", "'max'"),
    ],
)  # fmt: skip
def test_functions_of_a_formula(formula, name):
    study = {"model": "dimension_chain", "trials": 8, "seed": 1}
    study |= {"settings": {"gap": formula}, "links": {"A": "9 mm", "B": "5 mm"}}
    with pytest.raises(TolstatError) as refused:
        load(study)
    assert name in str(refused.value)


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("whatif", "'what-if'"), ("optimize", "'allocate'"), ("simulate", "'run'"),
        ("plot", "'show'"), ("replay", "'trial'"), ("raport", "'report'"),
    ],
)  # fmt: skip
def test_commands(word, name):
    answer = CliRunner().invoke(main, [word])
    assert answer.exit_code == 2
    assert f"No such command '{word}'; did you mean {name}" in answer.output


@pytest.mark.parametrize(
    ("word", "name"),
    [("monte-carlo", "random"), ("LHS", "latin"), ("qmc", "sobol"), ("tail", "rare")],
)
def test_samplings(word, name):
    with pytest.raises(TolstatError, match=f"no such sampling; did you mean '{name}'"):
        load({"model": "stand", "trials": 8, "seed": 1, "sampling": word})


def test_a_word_that_means_nothing_lists_what_is_allowed():
    assert allowed_names("poisson", ["normal", "beta"]) == "allowed: normal, beta"
