"""A ring that turns on two supports while it is cut: loss of cut, chatter, flutter."""

from tolstat.machines.ring.spectrum import spectrum as spectrum
