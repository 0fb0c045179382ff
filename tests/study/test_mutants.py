"""Mutated studies, a few of them; all of them by `python -m tests.study.mutants`."""

from __future__ import annotations

import warnings

import pytest

from tests.study.mutants import mutants, wrong_of_reading, wrong_of_running

FEW, RUN = 200, 3


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mutants")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return [(each, *wrong_of_reading(each, folder)) for each in mutants(FEW)]


def test_a_mutant_is_a_study_or_refused_by_its_key(read):
    wrong = [
        f"{m.number}, {m.seed.name}, {m.what}: {said}" for m, said, _ in read if said
    ]
    assert not wrong
    right = sum(right for _, _, right in read)
    assert 0 < right < FEW / 2  # most of them are mistakes


def test_on_the_command_line_a_mutant_is_a_message_and_exit_code_2(read, tmp_path):
    refused = [mutant for mutant, _, right in read if not right]
    for mutant in refused[:: len(refused) // RUN][:RUN]:
        assert not wrong_of_running(mutant, tmp_path)
