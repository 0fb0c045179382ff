"""A ring turned on two supports: loss of cut, chatter, flutter.

Equation numbers and letters are those of the paper:
A. I. Polunin, Mathematical simulation of dynamics of a rotating ring on supports
exposed to cutting forces (2012, in Russian).
"""

from tolstat.machines.ring.machine import spectrum as spectrum
