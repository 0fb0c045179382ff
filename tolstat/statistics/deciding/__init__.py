"""Limits decided by as few trials as possible."""
