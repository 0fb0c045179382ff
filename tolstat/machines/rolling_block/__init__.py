"""The rolling block: torsional drive of a wire-rod block whose gearbox is switched.

Equation numbers and letters are those of the paper:
P. V. Krot, Dynamic model of the gear drive of variable structure of a high-speed
wire-rod rolling block (2010, in Russian).
"""
