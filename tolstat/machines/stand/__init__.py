"""The stand: two parallel crank-rod chains drive the carriage of a cold pilger mill.

Equation numbers and letters are those of the paper:
E. Ya. Antonyuk, A. G. Zabuga, On the dynamic loading of machines with parallel
statically indeterminate kinematic chains (2012).
"""
