"""Doing what is asked: a study run on workers and stored."""
