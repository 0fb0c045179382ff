"""Deviations of parts: distributions inside tolerances, sampled reproducibly."""
