"""The modelDescription.xml of an FMU: what it offers. Its library is not loaded."""

import hashlib
import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from tolstat.errors import ModelError
from tolstat.fmu.base_units import BaseUnit
from tolstat.regular_files import UNREADABLE_ARCHIVE, opened

MOST_MEGABYTES = 64  # of the XML, unpacked
TRUE = ("true", "1")
REALS = ("Real", "Float32", "Float64")
KINDS_2 = ("Real", "Integer", "Boolean", "String", "Enumeration")  # of FMI 2
INTEGERS = (
    "Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Variable:
    """A variable of an FMU."""

    name: str
    reference: int  # its value reference
    type: str  # of FMI: "Real", "Float64", "Int32", "Enumeration", ...
    causality: str = "local"
    variability: str = "continuous"
    start: str | None = None
    unit: str = ""
    display: str = ""  # its display unit
    least: float = -math.inf
    most: float = math.inf
    items: dict[str, int] = field(default_factory=dict)  # of an enumeration
    sentence: str = ""
    array: bool = False

    @property
    def real(self) -> bool:
        """Whether it is a real number."""
        return self.type in REALS and not self.array

    @property
    def is_whole(self) -> bool:
        """Whether it is a whole number."""
        return self.type in INTEGERS and not self.array

    @property
    def numeric(self) -> bool:
        """Whether it has a value that a response can take."""
        others = self.type in ("Boolean", "Enumeration") and not self.array
        return self.real or self.is_whole or others

    @property
    def varied(self) -> bool:
        """Whether a study may set it: a parameter, or an input with a start value."""
        parameter = self.causality == "parameter" and self.variability != "constant"
        return (parameter or self.causality == "input") and self.start is not None


class Experiment(NamedTuple):
    """The default experiment; NaN where the FMU does not say."""

    start: float
    stop: float
    step: float
    rtol: float


@dataclass(frozen=True, kw_only=True)
class FmuFile:
    """An FMU, as its file describes it."""

    path: Path
    sha256: str  # of the file
    fmi: int  # 2 or 3
    name: str
    title: str
    tool: str  # that made it; empty where that is unknown
    token: str  # identifies the description to the library
    co_simulation: str  # name of the library; empty where it is not offered
    model_exchange: str
    experiment: Experiment
    states: int  # of FMI 2; one of FMI 3 tells itself
    indicators: int
    variables: tuple[Variable, ...]
    units: dict[str, BaseUnit]


def read_fmu(path: Path) -> FmuFile:
    """Return what an FMU offers.

    Raises
    ------
    ModelError
        If it is no FMU, or one that tolstat cannot run.
    """
    try:
        with opened(path) as file:
            sha256 = hashlib.sha256()
            while chunk := file.read(1 << 20):
                sha256.update(chunk)
            with zipfile.ZipFile(file) as archive:
                entry = archive.getinfo("modelDescription.xml")
                if entry.file_size > MOST_MEGABYTES * 1e6:
                    raise ModelError(
                        f"{path}: modelDescription.xml is larger than "
                        f"{MOST_MEGABYTES} MB, the most allowed"
                    )
                root = ElementTree.fromstring(archive.read(entry))
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}") from None
    except (*UNREADABLE_ARCHIVE, LookupError, SyntaxError, ValueError) as error:
        raise ModelError(
            f"{path} is not an FMU, a ZIP archive with modelDescription.xml ({error})"
        ) from None
    version = root.get("fmiVersion", "")
    if version[:2] not in ("2.", "3."):
        raise ModelError(
            f"{path} is of FMI {version or 'of an unknown version'}; FMI 2.0 and 3.0 "
            "are allowed; export it again"
        )
    fmi = int(version[0])
    try:
        return _described(root, path, sha256.hexdigest(), fmi)
    except (ValueError, OverflowError) as error:
        raise ModelError(f"{path}: modelDescription.xml: {error}") from None


def _described(root: Element, path: Path, sha256: str, fmi: int) -> FmuFile:
    types = dict(_types(root, fmi))
    offered = {
        kind: getattr(root.find(kind), "attrib", {}).get("modelIdentifier", "")
        for kind in ("CoSimulation", "ModelExchange")
    }
    if not any(offered.values()):
        raise ModelError(
            f"{path} offers neither co-simulation nor model exchange; export it with "
            "one of them"
        )
    for name in offered.values():
        if name and not name.isidentifier():
            raise ModelError(f"{path}: '{name}' is no name of a library")
    default = getattr(root.find("DefaultExperiment"), "attrib", {})
    times = (
        float(default.get(key, "nan"))
        for key in ("startTime", "stopTime", "stepSize", "tolerance")
    )
    return FmuFile(
        path=path,
        sha256=sha256,
        fmi=fmi,
        name=root.get("modelName", "") or path.stem,
        title=_line(root.get("description", "")),
        tool=_line(root.get("generationTool", "")),
        token=root.get("guid" if fmi == 2 else "instantiationToken", ""),
        co_simulation=offered["CoSimulation"],
        model_exchange=offered["ModelExchange"],
        experiment=Experiment(*times),
        states=len(root.findall("ModelStructure/Derivatives/Unknown")),
        indicators=int(root.get("numberOfEventIndicators", "0")),
        variables=tuple(_variables(root, types, fmi)),
        units={
            unit.get("name", ""): BaseUnit.read(base.attrib)
            for unit in root.iterfind("UnitDefinitions/Unit")
            if (base := unit.find("BaseUnit")) is not None
        },
    )


def _types(root: Element, fmi: int) -> Iterator[tuple[str, Element]]:
    """Yield the declared types, by name."""
    for declared in root.iterfind("TypeDefinitions/*"):
        kind = next(iter(declared), declared) if fmi == 2 else declared
        yield declared.get("name", ""), kind


def _variables(
    root: Element, types: dict[str, Element], fmi: int
) -> Iterator[Variable]:
    """Yield the variables; in FMI 2 the type of one is an element in it."""
    path = "ModelVariables/ScalarVariable" if fmi == 2 else "ModelVariables/*"
    for element in root.iterfind(path):
        for kind in element if fmi == 2 else [element]:
            if fmi == 3 or kind.tag in KINDS_2:
                yield _variable(element, kind, types)


def _variable(element: Element, kind: Element, types: dict[str, Element]) -> Variable:
    """Return a variable; what it does not say its declared type does."""
    declared = types.get(kind.get("declaredType", ""), Element(""))
    facts = {**declared.attrib, **kind.attrib}
    first = element.find("Start")  # of a text in FMI 3.0
    default = "continuous" if kind.tag in REALS else "discrete"
    return Variable(
        name=element.get("name", ""),
        reference=int(element.get("valueReference", "")),
        type=kind.tag,
        causality=element.get("causality", "local"),
        variability=element.get("variability", default),
        start=kind.get("start") if first is None else first.get("value"),
        unit=facts.get("unit", ""),
        display=facts.get("displayUnit", ""),
        least=float(facts.get("min", "-inf")),
        most=float(facts.get("max", "inf")),
        items={
            item.get("name", ""): int(item.get("value", ""))
            for item in declared.iterfind("Item")
        },
        sentence=_line(element.get("description", "")),
        array=element.find("Dimension") is not None,
    )


def _line(text: str) -> str:
    """Return a text in one line that can be printed."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
