"""The rolling block: torsional drive of a wire-rod block whose gearbox is switched."""
