"""Answers about runs: one folder for each question."""
