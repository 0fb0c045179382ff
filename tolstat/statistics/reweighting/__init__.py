"""Trials weighted to stand for other distributions."""
