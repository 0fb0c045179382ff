"""Ten dimension chains that miss limits; one of them no free link can mend."""

from __future__ import annotations

FIXED = {"fixed": True}
BEARING = {"tolerance": "-0.12..0 mm", "distribution": "uniform", **FIXED}
UNSOLVABLE = ("too wide a bought part",)


def _chain(gaps, limits, **links):
    """A study; links are nominal value and tolerance, or keys."""
    tables = {
        name: link if isinstance(link, dict) else dict(
            zip(("nominal", "tolerance"), link, strict=True)
        )
        for name, link in links.items()
    }  # fmt: skip
    return {
        "model": "dimension_chain", "trials": 4096, "seed": 1,
        "gaps": gaps, "links": tables, "limits": limits,
    }  # fmt: skip


def _bearing(**keys):
    return {"nominal": "20 mm", **BEARING, **keys}


CHAINS = {
    "off centre": _chain(
        {"gap": "housing - shaft - b_1 - b_2"}, {"gap": "0.15..0.6 mm"},
        housing=("120.6 mm", "+-0.12 mm"), shaft=("80 mm", "h8"),
        b_1=_bearing(), b_2=_bearing(),
    ),
    "two gaps, one housing": _chain(
        {"left": "housing - shaft - ring", "right": "cover + shaft + shim - housing"},
        {"left": "0..0.3 mm", "right": "0..0.35 mm"},
        housing=("100.25 mm", "+-0.1 mm"), shaft=("90 mm", "+-0.08 mm"),
        ring=("10 mm", "+-0.05 mm"), cover=("10.1 mm", "+-0.05 mm"),
        shim={"nominal": "0.3 mm", "tolerance": "+-0.01 mm", **FIXED},
    ),
    "off centre and wide": _chain(
        {"gap": "a - b - c"}, {"gap": "0.1..0.4 mm"},
        a=("50 mm", "+-0.2 mm"), b=("30 mm", "+-0.1 mm"), c=("19.6 mm", "+-0.08 mm"),
    ),
    "fit by grades": _chain(
        {"play": "bore - pin"}, {"play": "5..25 um"},
        bore=("20 mm", "H7"), pin=("20 mm", "h7"),
    ),
    "one end": _chain(
        {"stack": "p_1 + p_2 + p_3"}, {"stack": "<= 30.1 mm"},
        p_1=("10 mm", "+-0.08 mm"), p_2=("10 mm", "+-0.06 mm"),
        p_3=("10.02 mm", "+-0.05 mm"),
    ),
    "slanted": _chain(
        {"reach": "arm * cos(tilt) + tip", "height": "arm * sin(tilt) + foot"},
        {"reach": "96.4..96.8 mm", "height": "69.9..70.5 mm"},
        arm=("100 mm", "+-0.3 mm"), tip=("20 mm", "+-0.1 mm"),
        foot=("6 mm", "+-0.1 mm"), tilt=("40 deg", "+-0.1 deg"),
    ),
    "distance": _chain(
        {"far": "hypot(x, y) - pitch"}, {"far": "-0.1..0.1 mm"},
        x=("30 mm", "+-0.15 mm"), y=("40 mm", "+-0.12 mm"),
        pitch={"nominal": "50.05 mm", "tolerance": "+-0.03 mm", **FIXED},
    ),
    "three gaps": _chain(
        {"one": "h - a - b", "two": "h - c", "three": "c - e - a"},
        {"one": "0.05..0.45 mm", "two": "-0.15..0.2 mm", "three": "0..0.35 mm"},
        h=("50.3 mm", "+-0.1 mm"), a=("20 mm", "+-0.06 mm"), b=("30 mm", "+-0.06 mm"),
        c=("50.2 mm", "+-0.08 mm"), e=("30 mm", "+-0.05 mm"),
    ),
    "demanded Ppk": _chain(
        {"gap": "a - b"}, {"gap": {"limit": "0..0.3 mm", "ppk": 1.33}},
        a=("20.2 mm", "+-0.12 mm"), b=("20 mm", "+-0.1 mm"),
    ),
    "too wide a bought part": _chain(
        {"gap": "a - b - c"}, {"gap": "0..0.4 mm"},
        a=("60.2 mm", "+-0.05 mm"), b=("30 mm", "+-0.05 mm"),
        c={"nominal": "30 mm", "tolerance": "+-0.3 mm", **FIXED},
    ),
}  # fmt: skip
