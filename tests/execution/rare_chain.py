"""A chain whose gap is rarely out of limit."""

CHAIN = """\
model = "dimension_chain"
sampling = "rare"
trials = 5000
seed = 3
settings.gap = "A - B"
[links]
A = { nominal = "10 mm", tolerance = "+-0.3 mm" }
B = { nominal = "9 mm", tolerance = "+-0.4 mm" }
[limits]
gap = ">= 0.2 mm"
"""
