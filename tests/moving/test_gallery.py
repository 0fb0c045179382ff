"""The models of the gallery against SciPy and closed forms, at a few trials."""

from __future__ import annotations

import pytest

from tests.moving.gallery import NAMES, errors

RTOL = 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_a_model_of_the_gallery_against_its_reference(name):
    assert errors(name, RTOL).max() < 10.0 * RTOL
