"""Tolerances of drawings: grades and classes of the standards."""
