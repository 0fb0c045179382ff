"""Deviations of parts: distributions inside tolerances, drawn reproducibly."""
