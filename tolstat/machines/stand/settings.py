"""What a study may choose about the stand."""

from __future__ import annotations

from dataclasses import dataclass

from tolstat.model.settings import setting

# the guide contact with which the paper's Fig. 4 is met
FIG4_CONTACT_YAW = 5.8e-4


@dataclass(frozen=True)
class Settings:
    """Settings of the stand, SI; what each means stands in its sentence."""

    variant: str = setting(
        "indeterminate",
        "the machine as built, or with a link that makes both rod forces equal",
        choices=("indeterminate", "equalized"),
    )
    drive: str = setting(
        "direct",
        "gear 13 drives pinion 10, or a differential splits its torque equally",
        choices=("direct", "balanced"),
    )
    crank_speed: float = setting(7.5, "speed of the cranks", unit="rad/s", above=0.0)
    start_up: float = setting(1.0, "start-up time t1", unit="s", above=0.0)
    settle: int = setting(1, "turns between start-up and the window", at_least=0)
    cycles: int = setting(2, "turns in the window", at_least=1)
    contact_yaw: float | None = setting(
        None,
        "yaw at which the carriage touches its guides; geometry: dL/dh",
        unit="rad",
        above=0.0,
        presets={"geometry": None, "fig4": FIG4_CONTACT_YAW},
    )
    rtol: float = setting(
        1e-3, "integration tolerance, relative to each state's scale", above=0.0
    )
    max_step: float = setting(1e-3, "longest integration step", unit="s", above=0.0)
