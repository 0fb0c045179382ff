"""Runge-Kutta integration of many trials side by side; knows no machine."""
