"""A dimension chain: links, and the gap that they leave, as a formula.

The chain of a wave gear, runs/wave-gear.toml, is after
M. V. Margulis, V. V. Mitin, Dimension-functional analysis of the main parts of wave
gears with rolling bodies, and the accuracy that they need (2010, in Russian).
It prints no equation.
"""
