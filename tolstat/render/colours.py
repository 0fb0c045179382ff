"""The colours of pictures, by their roles."""

from tolstat.document.plot import CURVE_COLOURS

# distinct in print and for the colour-blind (Okabe and Ito, 2008)
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
LIMIT, INK, GRID = "#b00020", "#101418", "#e1e3e6"
ROLES = {
    **dict(zip(CURVE_COLOURS, COLOURS, strict=True)),
    "limit": LIMIT, "ink": INK, "grid": GRID,
}  # fmt: skip
# on a page these are those of its style, in light and in dark
ON_PAGE = {
    **ROLES, "limit": "var(--not-met)", "ink": "currentColor", "grid": "var(--grid)",
}  # fmt: skip
