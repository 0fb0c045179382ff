"""Settings of a chain: its links, and its closing link as a formula."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tolstat.errors import ModelError, UnitError
from tolstat.machines.dimension_chain.algebras import Dimensions, Kind, Values
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.model.settings import column, setting
from tolstat.units.grammar import Measure

# a ball between the discs of a wave gear, and their track
WAVE_GEAR = {
    "R_out": {"nominal": Measure(0.060, "m")},
    "R_in": {"nominal": Measure(0.047935, "m")},
    "e": {"nominal": Measure(0.002, "m")},
    "d": {"nominal": Measure(0.010, "m")},
}
TEMPERATURES = "K", "degC"
CLEARANCE = "R_out - R_in - e - d"


@dataclass(frozen=True)
class Settings:
    """Links and closing link of a chain."""

    links: dict[str, Any] = setting(
        WAVE_GEAR,
        "links; a study gives them in its section [links], with their tolerances",
        columns={"nominal": column("its size", like=Measure(0.0, "m"))},
    )
    gap: str = setting(CLEARANCE, "closing link, as a formula of the links")

    def __post_init__(self) -> None:
        """Check that the formula names links, and has a value where all are nominal.

        Raises ModelError if not; the message says where in the formula, and why.
        """
        if self.gap == CLEARANCE and not set(WAVE_GEAR) <= set(self.links):
            names = ", ".join(self.links)
            raise ModelError(
                f"gap is missing: the closing link as a formula of {names}"
            )
        warm = {link["nominal"].shown: name for name, link in self.links.items()}
        if {*TEMPERATURES} <= warm.keys():
            typed = " and ".join(f"{warm[unit]} in {unit}" for unit in TEMPERATURES)
            raise ModelError(
                f"{typed}: both are differences of temperature; give both in one unit"
            )
        self.formula.worked_out(Values(self.nominal, strict=True))
        try:
            _ = self.unit
        except UnitError as error:
            raise ModelError(f"gap = {self.gap!r}: {error}") from None

    @property
    def formula(self) -> Formula:
        """The closing link, read."""
        return Formula(self.gap, tuple(self.links))

    @property
    def nominal(self) -> dict[str, float]:
        """Every link, SI."""
        return {n: np.float64(link["nominal"].value) for n, link in self.links.items()}

    @property
    def unit(self) -> str:
        """SI unit of the closing link."""
        units = {name: link["nominal"].unit for name, link in self.links.items()}
        kind: Kind = self.formula.worked_out(Dimensions(units))
        return kind.unit
