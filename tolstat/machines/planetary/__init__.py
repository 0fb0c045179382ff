"""Planetary gears AA, II, AI with helical wheels whose axial forces are balanced.

Equation numbers and letters are those of a paper of 2010, in Russian. Its end alone is
printed, from (7) on, without title and authors.
"""

from tolstat.machines.planetary.scheme import existence as existence
from tolstat.machines.planetary.synthesis import designs as designs
