"""Computations after the trials of a run: audit, slopes, worst cases."""
