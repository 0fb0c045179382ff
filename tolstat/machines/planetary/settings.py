"""What a study may choose about a planetary gear."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

from tolstat.machines.planetary.design import GearSettings
from tolstat.machines.planetary.synthesis import ORDERS
from tolstat.machines.planetary.wanted import MOST_TEETH, STEEPEST
from tolstat.model.settings import setting
from tolstat.units.grammar import Range


@dataclass(frozen=True)
class Settings(GearSettings):
    """Settings of a planetary gear, and of the view that lists others, SI."""

    wanted_ratio: float | None = setting(
        None,
        "view designs: wanted ratio; own: that of the teeth",
        presets={"own": None},
    )
    ratio_tolerance: float = setting(
        0.01,
        "view designs: how far the ratio may be off",
        unit="1",
        at_least=0.0,
        at_most=1.0,
    )
    z1: Range = setting(
        Range(17, 90), "view designs: teeth of wheel 1", at_least=5, at_most=MOST_TEETH
    )
    z2: Range = setting(
        Range(17, 60), "view designs: teeth of wheel 2", at_least=5, at_most=MOST_TEETH
    )
    z3: Range = setting(
        Range(17, 60), "view designs: teeth of wheel 3", at_least=5, at_most=MOST_TEETH
    )
    z4: Range = setting(
        Range(17, 130), "view designs: teeth of wheel 4", at_least=5, at_most=MOST_TEETH
    )
    helix: Range = setting(
        Range(radians(8), radians(30)),
        "view designs: helix angles of both rims",
        unit="rad",
        at_least=0.0,
        at_most=STEEPEST,
    )
    order: str = setting(
        "ratio_error", "view designs: what comes first", choices=ORDERS
    )
