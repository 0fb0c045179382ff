"""Digest of a computation: the code of its files counts, comments do not."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from contextlib import contextmanager

import pytest

from tests.conftest import ROOT
from tolstat import catalogue
from tolstat.lanes import cache, digest

OWN = '''"""A model of one's own, in two files."""

import numpy as np
from far import shift
from tolstat import Contributor, Description, Model, Outcome, Response

NAMES = ("x", "y")


class Own(Model):
    """A sum."""

    name = "own"
    title = "a sum"
    failures = {"too long": "x is short"}

    def describe(self, settings):
        parts = tuple(Contributor(n, "m", n, f"length of {n}") for n in NAMES)
        return Description(parts, (Response("gap", "m", sentence="the gap"),))

    def impossible(self, deviations, settings):
        return {"too long": deviations[:, 0] > 1.0}

    def evaluate(self, deviations, settings):
        if len(deviations) > 1000:
            raise ValueError("too many")
        return Outcome(shift(deviations[:, :1] + np.sin(deviations[:, 1:])))

    def numbers(self, settings, spreads, *, independent=True):
        return ()
'''
FAR = '''"""Beside it."""

LONG = 2.0


def shift(x: float) -> float:
    """Shift."""
    return x - LONG


def other(x):
    return x + 5.0
'''


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of the package, of the coverage's problems and of a model of one's own."""
    tmp_path = tmp_path_factory.mktemp("digest")
    shutil.copytree(ROOT / "tolstat", tmp_path / "tolstat")
    shutil.copytree(
        ROOT / "tests/studies/coverage", tmp_path / "tests/studies/coverage"
    )
    (tmp_path / "tests/__init__.py").touch()
    (tmp_path / "tests/studies/__init__.py").touch()
    (tmp_path / "own").mkdir()
    (tmp_path / "own/own.py").write_text(OWN)
    (tmp_path / "own/far.py").write_text(FAR)
    (tmp_path / "own/unused.py").write_text("LONG = 5.0\n")
    return tmp_path


@pytest.fixture
def tree(copied, monkeypatch):
    """Where the package is looked for."""
    monkeypatch.setattr(digest, "PACKAGE", copied / "tolstat")
    yield copied
    digest.digest.cache_clear()


@pytest.fixture(scope="module")
def known(copied):
    """The digests before anything is edited."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(digest, "PACKAGE", copied / "tolstat")
        return digests(copied)


def digests(tree):
    """Digest models, the integrator as it is compiled, and what measures intervals."""
    digest.digest.cache_clear()
    evaluating = tree / "tolstat/model/checked.py"
    engine = [tree / "tolstat/lanes" / path.name for path in cache.ENGINE]
    roots = {
        name: [evaluating, tree / f"{module.replace('.', '/')}.py"]
        for name, (module, _) in MODELS.items()
    }
    for name in sorted(COMPILED):
        roots[name] = [tree / "tolstat" / name, *engine]
    for name in ("one_response", "halving_problems"):
        roots[name] = [tree / f"tests/studies/coverage/{name}.py"]
    return {name: digest.digest(*files) for name, files in roots.items()}


@contextmanager
def edited(file, before, after):
    text = file.read_text()
    assert before in text
    file.write_text(text.replace(before, after))
    yield
    file.write_text(text)


MODELS = {**catalogue.MACHINES, "own": ("own.own", "Own")}
for slow in ("elastic_machine", "rolling_block"):  # as the stand and the ring
    del MODELS[slow]
MOVING = {"stand", "ring"}
COMPILED = {"integrator/march.py", "machines/stand/compiled.py"}
STAND = "tolstat/machines/stand"
OF_STAND = {"stand", "machines/stand/compiled.py"}

# file, before, after: nothing that is computed changes
WORDS = [
    pytest.param("tolstat/integrator/step.py", "\nfrom ", "\n# a word\n\nfrom ", id="comment"),
    pytest.param("tolstat/lanes/elementary.py", "Return the sine;", "The sine;", id="docstring"),
    pytest.param("tolstat/integrator/march.py", '"""Integrate every', '"""March every', id="docstring of compiled code"),
    pytest.param(f"{STAND}/declarations.py", '"""Settings, contrib', '"""The settings, contrib', id="docstring of a file"),
    pytest.param(f"{STAND}/views.py", " = ", "  =  ", id="space"),
    pytest.param("tolstat/catalogue.py", '"ring": ', '"rings": ', id="what no model imports"),
    pytest.param("own/own.py", '"""A sum."""', '"""Sum."""', id="own docstring"),
    pytest.param("own/unused.py", "5.0", "6.0", id="own file, not imported"),
    pytest.param("tests/studies/coverage/problems.py", "rods of +-0.9 mm, of", "rods, of", id="docstring of a problem"),
    pytest.param("tolstat/statistics/intervals/weights.py", '"""Return bounds of', '"""Return ends of', id="docstring of an interval"),
]  # fmt: skip

# file, before, after, and whose digest changes
CODE = [
    pytest.param(f"{STAND}/motion.py", "p.k1 * ", "-p.k1 * ", {"stand", "machines/stand/compiled.py"}, id="sign in an equation"),
    pytest.param(f"{STAND}/parameters.py", "N.l + dl", "N.l - dl", OF_STAND, id="operator in a model"),
    pytest.param(f"{STAND}/clearance.py", "-D1 - w1", "-D1 + w1", {"stand"}, id="sign in a law of few trials"),
    pytest.param(f"{STAND}/declarations.py", '_C(f"rod_length_{i}"', '_C(f"rod_lengths_{i}"', OF_STAND, id="name of a contributor"),
    pytest.param(f"{STAND}/declarations.py", "range=SHARE", "range=(0.0, 2.0)", OF_STAND, id="range"),
    pytest.param(f"{STAND}/declarations.py", "1e-", "2e-", OF_STAND, id="default"),
    pytest.param("tolstat/integrator/problem.py", "TIGHTER, LEAST_RTOL = 1000.0", "TIGHTER, LEAST_RTOL = 100.0", {*MODELS, *COMPILED}, id="tighter settings"),
    pytest.param("tolstat/machines/dimension_chain/formula.py", 'ast.Sub: "-"', 'ast.Sub: "+"', {"dimension_chain"}, id="operator of a formula"),
    pytest.param("tolstat/integrator/tableau.py", "19372", "19373", MOVING | COMPILED, id="constant of the integrator"),
    pytest.param("tolstat/integrator/march.py", "h * factor", "h / factor", MOVING | COMPILED, id="operator of the integrator"),
    pytest.param("tolstat/integrator/step.py", "SAFETY = ", "SAFETY = -", MOVING | COMPILED, id="sign in the step control"),
    pytest.param("tolstat/lanes/elementary.py", "-0.5, 1.0", "-0.5, 1.1", MOVING | COMPILED, id="constant of a lane function"),
    pytest.param("tolstat/lanes/elementary.py", "r * r", "r + r", MOVING | COMPILED, id="operator of a lane function"),
    pytest.param("tolstat/lanes/vector.py", "ir.IRBuilder.fsub", "ir.IRBuilder.fadd", MOVING | COMPILED, id="what is taught to Numba"),
    pytest.param("tolstat/lanes/vector.py", "fabs", "ceil", MOVING | COMPILED, id="what a function for Numba calls"),
    pytest.param("tolstat/lanes/elementary.py", "np.log)", "np.exp)", MOVING | COMPILED, id="a decorated function"),
    pytest.param("tolstat/lanes/compiled.py", '"contract", ', "", MOVING | COMPILED, id="option of the compiler"),
    pytest.param("tolstat/model/checked.py", "status == 0)", "status >= 0)", set(MODELS), id="what evaluates"),
    pytest.param("own/own.py", "np.sin", "np.cos", {"own"}, id="function of a model of one's own"),
    pytest.param("own/own.py", "> 1.0", "> 2.0", {"own"}, id="what cannot be built"),
    pytest.param("own/own.py", '("x", "y")', '("y", "x")', {"own"}, id="order of contributors"),
    pytest.param("own/far.py", "x - LONG", "x + LONG", {"own"}, id="operator in a file beside"),
    pytest.param("own/far.py", "LONG = 2.0", "LONG = 2.5", {"own"}, id="constant in a file beside"),
    pytest.param("own/own.py", '"a sum"', '"two parts"', {"own"}, id="title"),
    pytest.param(f"{STAND}/views.py", "Panel(", "Panel(*(), ", {"stand"}, id="view"),
    pytest.param(f"{STAND}/declarations.py", "start-up", "starting", OF_STAND, id="sentence of a setting"),
    pytest.param("own/own.py", "from far import shift", "from far import other as shift", {"own"}, id="import"),
    pytest.param("tolstat/deviations/samplers.py", "* 2.0**BITS", "* 2.5**BITS", {"one_response"}, id="sampler"),
    pytest.param("tolstat/deviations/distributions.py", "-np.log", "np.log", {"halving_problems", *MODELS, *OF_STAND}, id="distribution"),
    pytest.param("tolstat/statistics/intervals/weights.py", "MOST_STAKED = 0.75", "MOST_STAKED = 0.76", {"one_response", "halving_problems"}, id="interval"),
    pytest.param("tests/studies/coverage/problems.py", "SIZES = (50,", "SIZES = (51,", {"one_response", "halving_problems"}, id="problem"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "before", "after"), WORDS)
def test_texts_do_not_change_the_digest(tree, known, file, before, after):
    with edited(tree / file, before, after):
        now = digests(tree)
    assert now == known


@pytest.mark.parametrize(("file", "before", "after", "whose"), CODE)
def test_code_changes_the_digest_of_its_users(tree, known, file, before, after, whose):
    with edited(tree / file, before, after):
        now = digests(tree)
    assert {name for name in known if known[name] != now[name]} == whose


FIRST = """from numba import types
from part import of
from tolstat.lanes.compiled import compiled


@compiled(types.float64(types.float64))
def add(a):
    return of(a) + 1.0
"""
PART = """from tolstat.moving import compiled


@compiled(within=True)
def of(a):
    return a * 2.0
"""


def test_compiled_code_is_never_stale(tmp_path, monkeypatch):
    """Whatever Numba's cache goes by: files, lines, times of files."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(tmp_path)

    def answered(first, part):
        for name, text in (("first", first), ("part", part)):
            path = tmp_path / f"{name}.py"
            path.write_text(text)
            os.utime(path, (1e9, 1e9))
            sys.modules.pop(name, None)
        digest.digest.cache_clear()
        cache.cache_folder.cache_clear()
        importlib.invalidate_caches()
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        module = importlib.import_module("first")
        hits = sum(module.add.stats.cache_hits.values())
        folders = len([*(tmp_path / "cache").glob("tolstat-*")])
        return module.add(3.0), hits, folders

    two = PART.replace("a * 2.0", "a * 3.0")
    assert answered(FIRST, PART) == (7.0, 0, 1)
    assert answered(FIRST, PART) == (7.0, 1, 1)
    # words and lines of either: the same folder, and what is called is not seen
    assert answered(FIRST, "# a word\n" + PART) == (7.0, 1, 1)
    assert answered("# a word\n" + FIRST, PART) == (7.0, 0, 1)
    # what is called: as many bytes, as old
    assert answered(FIRST, two) == (10.0, 0, 2)
    assert answered("# a word\n" + FIRST, two) == (10.0, 0, 2)
    assert answered(FIRST.replace("+ 1.0", "- 1.0"), PART) == (5.0, 0, 3)
    # another function in the line where the first one stood, then of its name too
    head, _, body = FIRST.partition("\n\n\n")
    nine, other = body.replace("1.0", "9.0"), body.replace("def add", "def sub")
    assert answered("\n\n\n".join((head, other, nine)), PART)[::2] == (15.0, 4)
    assert answered("\n\n\n".join((head, nine, other)), PART)[::2] == (15.0, 5)
    # both renamed: each name is found with its own code
    nine = nine.replace("add", "sub")
    assert answered("\n\n\n".join((head, nine, body)), PART)[::2] == (7.0, 6)
    assert answered(FIRST, PART)[::2] == (7.0, 6)
