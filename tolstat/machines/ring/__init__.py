"""A ring turned on two supports: loss of cut, chatter, flutter."""

from tolstat.machines.ring.spectrum import spectrum as spectrum
