"""Runs whose pages are looked at."""

from tests.answers.conftest import linked, mill

__all__ = ["linked", "mill"]
