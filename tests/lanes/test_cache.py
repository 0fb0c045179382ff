"""Compiled code that others could have written is never executed."""

from __future__ import annotations

import importlib
import json
import os
import pickle
import sys

import pytest

from tolstat.lanes import cache
from tolstat.lanes.cache import _digests

ADD = """from numba import types
from tolstat.lanes.compiled import compiled


@compiled(types.float64(types.float64, types.float64))
def add(a, b):
    return a + b
"""


class Poison:
    """Makes a folder when it is loaded."""

    def __init__(self, folder):
        self.folder = str(folder)

    def __reduce__(self):
        return os.mkdir, (self.folder,)


@pytest.fixture
def poisoned(tmp_path, monkeypatch):
    """Return a function that compiles again, and the folder that poison makes."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "small.py").write_text(ADD)

    def compile_again():
        sys.modules.pop("small", None)
        cache.cache_folder.cache_clear()
        return importlib.import_module("small").add(1.0, 2.0)

    assert compile_again() == 3.0
    (index,) = (tmp_path / "cache").rglob("*.nbi")
    index.write_bytes(pickle.dumps(Poison(tmp_path / "executed")))
    home = index.parents[1]
    (home / "written.json").write_text(json.dumps(_digests(home)))
    return compile_again, tmp_path / "executed"


@pytest.fixture
def folder_of_code(tmp_path, poisoned):
    (folder,) = (tmp_path / "cache").glob("tolstat-*")
    return folder


def test_the_poison_works(poisoned, folder_of_code):
    """Where this user alone can write, what is kept is believed."""
    compile_again, executed = poisoned
    assert folder_of_code.stat().st_mode & 0o777 == 0o700
    with pytest.warns(RuntimeWarning, match="is damaged"):
        assert compile_again() == 3.0
    assert executed.is_dir()


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o755])
def test_a_folder_that_was_not_private_is_emptied(poisoned, folder_of_code, mode):
    compile_again, executed = poisoned
    folder_of_code.chmod(mode)
    assert compile_again() == 3.0
    assert not executed.exists()
    assert folder_of_code.stat().st_mode & 0o777 == 0o700


def test_a_folder_that_others_can_replace_is_not_used(poisoned, folder_of_code):
    compile_again, executed = poisoned
    folder_of_code.parent.chmod(0o777)
    with pytest.warns(RuntimeWarning, match=f"can write to {folder_of_code.parent}"):
        assert compile_again() == 3.0
    assert not executed.exists()
    folder_of_code.parent.chmod(0o1777)  # as /tmp: nobody replaces what others own
    with pytest.warns(RuntimeWarning, match="is damaged"):
        compile_again()


def test_a_folder_of_another_user_is_not_used(poisoned, folder_of_code, monkeypatch):
    compile_again, executed = poisoned
    user = os.getuid()
    if user:
        monkeypatch.setattr(os, "getuid", lambda: user + 1)
    else:
        os.chown(folder_of_code, 1000, -1)
    with pytest.warns(RuntimeWarning, match="belongs to another user"):
        assert compile_again() == 3.0
    assert not executed.exists()


def test_a_link_is_followed_before_it_is_judged(poisoned, folder_of_code, tmp_path):
    """The owner of a link could let it lead to private folders or to poisoned ones."""
    compile_again, executed = poisoned
    target = tmp_path / "others" / folder_of_code.name
    target.parent.mkdir()
    folder_of_code.rename(target)
    folder_of_code.symlink_to(target)
    target.parent.chmod(0o777)
    with pytest.warns(RuntimeWarning, match=r"others\): every"):
        assert compile_again() == 3.0
    assert not executed.exists()
