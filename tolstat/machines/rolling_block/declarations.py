"""Contributors and responses of the rolling block: names, units, words."""

from __future__ import annotations

import math

from tolstat.machines.rolling_block.topology import LINK_NAMES, LINKS, MASSES
from tolstat.model.description import Contributor, Description, Response

_C = Contributor
_R = Response
POSITIVE = (0.0, math.inf)

JOINED = tuple(f"{MASSES[i]} to {MASSES[j]}" for i, j in LINKS)
N_MODES = len(LINKS)

CONTRIBUTORS = (
    *(_C(f"inertia_{i}", "1", f"Q{i}", f"moment of inertia: {mass}", "(1)", part="inertias") for i, mass in enumerate(MASSES, start=1)),
    *(_C(f"stiffness_{ij}", "1", f"C{ij}", f"torsional stiffness: {joined}", "(1)", part="stiffnesses") for ij, joined in zip(LINK_NAMES, JOINED, strict=True)),
    _C("damping", "1", "zeta", "damping ratio of every elastic mode", "modal damping", part="damping"),
)  # fmt: skip

RESPONSES = (
    *(_R(f"frequency_{r}", "Hz", f"f{r}", f"natural frequency {r}, ascending, without the rigid mode", "(1)", shown="Hz", range=POSITIVE) for r in range(1, N_MODES + 1)),
    *(_R(f"amplification_{ij}", "1", f"K{ij}", f"peak moment over the static one: {joined}", "max |M_ij| / M_ij,static", shown="1", range=POSITIVE) for ij, joined in zip(LINK_NAMES, JOINED, strict=True)),
    *(_R(f"moment_peak_{ij}", "N m", f"|M{ij}|", f"peak elastic moment, loads stepping: {joined}", "(2)", range=POSITIVE) for ij, joined in zip(LINK_NAMES, JOINED, strict=True)),
    *(_R(f"pulse_peak_{ij}", "N m", f"|M{ij}|", f"peak elastic moment, pulse on a stand: {joined}", "(2)", shown="N m", range=POSITIVE) for ij, joined in zip(LINK_NAMES, JOINED, strict=True)),
    _R("cancellation", "1", "|a2/a1|", "what mode 2 adds to M12, over mode 1, loads on 32 and 33", "Fig. 4", range=POSITIVE),
    _R("leakage", "1", "|a3,4/a1|", "what the local modes 3, 4 add to M12, the greater over mode 1, loads on 32 and 33", "Fig. 4", range=POSITIVE),
    _R("antiphase_pattern", "1", "", "1 if stands swing in antiphase where they do in the nominal drive, else 0", "Table 1", shown="count", range=(0.0, 1.0)),
    _R("free_speed_range", "rad/s", "", "width of all speeds without resonance", "Fig. 5", shown="rpm", range=POSITIVE),
    _R("widest_free_range", "rad/s", "", "width of the widest range of speeds without resonance", "Fig. 5", shown="rpm", range=POSITIVE),
    _R("speed_margin", "1", "", "distance of the working speed from the nearest resonance, as a share of the natural frequency", "Fig. 5", range=POSITIVE),
)  # fmt: skip

DESCRIPTION = Description(CONTRIBUTORS, RESPONSES)
