"""Runge-Kutta integration of many trials in parallel, independent of models."""
