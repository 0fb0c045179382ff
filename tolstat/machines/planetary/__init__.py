"""Planetary gears AA, II, AI with helical wheels whose axial forces are balanced."""

from tolstat.machines.planetary.scheme import existence as existence
from tolstat.machines.planetary.synthesis import designs as designs
