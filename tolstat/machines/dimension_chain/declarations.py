"""Settings of a chain: its links, and its closing links as formulas."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.errors import ModelError, UnitError
from tolstat.machines.dimension_chain.algebras import Dimensions, Kind, Values
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.model.settings import column, setting
from tolstat.units.conversion import CELSIUS, known_name
from tolstat.units.grammar import Measure

if TYPE_CHECKING:
    from tolstat.machines.dimension_chain.loops import Loops

# a ball between the discs of a wave gear, and their track
WAVE_GEAR = {
    "R_out": {"nominal": Measure(0.060, "m")},
    "R_in": {"nominal": Measure(0.047935, "m")},
    "e": {"nominal": Measure(0.002, "m")},
    "d": {"nominal": Measure(0.010, "m")},
}
GAP = "gap"  # the closing link of a chain that has one
CLEARANCE = "R_out - R_in - e - d"


@dataclass(frozen=True)
class Settings:
    """Links and closing links of a chain."""

    links: dict[str, Any] = setting(
        WAVE_GEAR,
        "links; a study gives them in its section [links], with their tolerances",
        columns={"nominal": column("its size", like=Measure(0.0, "m"))},
    )
    gap: str = setting(
        CLEARANCE,
        "closing link, as a formula of the links; several have names, in a section "
        '[gaps]: play = "a - b"',
    )
    gaps: dict[str, Any] = setting(
        {},
        "closing links by name, instead of gap; a study has them in its section [gaps]",
        columns={"formula": column("a formula of links and gaps", like="")},
    )
    loops: dict[str, Any] = setting(
        {},
        "vector loops by name, whose unknowns may stand in gaps; a study has them in "
        "its section [loops], also near which values unknowns are looked for",
        columns={"loop": column("lengths @ directions, or a start", like="")},
    )

    def __post_init__(self) -> None:
        """Check that formulas name links, and have values where all are nominal.

        Raises ModelError if not; the message says where in the formula, and why.
        """
        if not self.gaps and not self.loops and self._gap_missing:
            names = ", ".join(self.links)
            raise ModelError(
                f"gap is missing: the closing link as a formula of {names}"
            )
        if self.gaps and self.gap != CLEARANCE:
            raise ModelError("gap is given in [settings] too; give it here, by a name")
        try:
            _ = self.closed
        except ModelError as error:
            error.section = "loops"
            raise
        # a gap after those that it names: they have the places of what is wrong
        for formula in sorted(self.formulas.values(), key=lambda f: len(f.gaps)):
            formula.worked_out(Values(self.nominal, strict=True))
            try:
                self.unit_of(formula)
            except UnitError as error:
                raise ModelError(f"{formula.gap} = {formula.text!r}: {error}") from None
        self._check_temperatures()

    def _check_temperatures(self) -> None:
        """Refuse temperatures in K where others are in degC: one may be absolute."""
        typed = {
            name: nominal.shown
            for name, link in self.links.items()
            if (nominal := link["nominal"]).unit == "K"
        }
        for formula in self.formulas.values():
            numbers = [q for q in formula.quantities if q.unit == "K"]
            typed |= {f"{q} of {formula.gap}": "K" for q in numbers}
        scales = dict[str, str]()
        for name, unit in typed.items():
            scale = CELSIUS if known_name(unit) == CELSIUS else "K"
            scales.setdefault(scale, f"{name} in {scale}")
        if len(scales) > 1:
            raise ModelError(
                f"{scales['K']} and {scales[CELSIUS]}: both are differences of "
                "temperature; give both in one unit, as links"
            )

    @cached_property
    def formulas(self) -> dict[str, Formula]:
        """The closing links by name, read."""
        texts = {name: row["formula"] for name, row in self.gaps.items()}
        links, loops = tuple(self.links), self.closed
        if texts:
            # seldom needed
            from tolstat.machines.dimension_chain.gaps import formulas_of

            return formulas_of(texts, links, loops)
        if loops and self._gap_missing:  # then its unknowns are what is looked for
            return {n: Formula(n, links, n, loops=loops) for n in loops.unknowns}
        return {GAP: Formula(self.gap, links, GAP, loops=loops)}

    @property
    def _gap_missing(self) -> bool:
        return self.gap == CLEARANCE and not set(WAVE_GEAR) <= set(self.links)

    @cached_property
    def closed(self) -> "Loops | None":
        """The vector loops, read and solved; None without."""
        if not self.loops:
            return None
        from tolstat.machines.dimension_chain.loops import Loops  # no other chain needs

        texts = {name: row["loop"] for name, row in self.loops.items()}
        sizes = {name: link["nominal"] for name, link in self.links.items()}
        return Loops(texts, sizes)

    @property
    def nominal(self) -> dict[str, float]:
        """Every link, SI."""
        return {n: np.float64(link["nominal"].value) for n, link in self.links.items()}

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every link."""
        return {name: link["nominal"].unit for name, link in self.links.items()}

    def unit_of(self, formula: Formula) -> str:
        """Return the SI unit of a closing link."""
        kind: Kind = formula.worked_out(Dimensions(self.units))
        return kind.unit
