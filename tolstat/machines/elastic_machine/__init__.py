"""The elastic machine: a chain of masses on springs, started from its other end.

Equation numbers and letters are those of the paper:
Yu. A. Semenov, N. S. Semenova, Transient processes in an elastic machine (2024, in
Russian).
"""
