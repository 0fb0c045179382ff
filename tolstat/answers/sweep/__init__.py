"""Runs of a grid or a table."""
