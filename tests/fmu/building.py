"""FMUs built by gcc: our own from `sources`, and others' from `reference`.

`python -m tests.fmu.building FOLDER [NAME ...]` builds ours. FMPy has FMI's headers.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

HERE = Path(__file__).parent
SOURCES, REFERENCE = HERE / "sources", HERE / "reference"
LIBRARIES = {2: "linux64", 3: "x86_64-linux"}
GCC = ("gcc", "-O2", "-shared", "-fPIC", "-w", "-Wl,-Bsymbolic")


def headers():
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"


@dataclass
class V:
    """A variable of a model description."""

    name: str
    reference: int
    causality: str = "parameter"
    variability: str = "fixed"
    start: object = None
    unit: str = ""
    least: float | None = None
    most: float | None = None
    text: str = ""
    derivative_of: int | None = None
    type: str = "Real"


def outputs(**references):
    return [V(n, r, "output", "continuous") for n, r in references.items()]


def states(*names, first):
    """States and their derivatives, as tiny.h numbers them."""
    count = len(names)
    here = [V(n, first + i, "local", "continuous") for i, n in enumerate(names)]
    rates = [
        V(
            f"der({n})",
            first + count + i,
            "local",
            "continuous",
            derivative_of=first + i,
        )
        for i, n in enumerate(names)
    ]
    return here + rates


@dataclass
class Source:
    """A model in C with its description."""

    header: str
    token: str
    stop: float
    variables: list[V]
    indicators: int = 0
    enumeration: tuple[str, Sequence[str]] | None = None
    flags: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)


UNITS = {
    "kg": "kg='1'", "N/m": "kg='1' s='-2'", "N.s/m": "kg='1' s='-1'", "m": "m='1'",
    "N": "kg='1' m='1' s='-2'", "m/s": "m='1' s='-1'",
    "mm": "m='1' factor='0.001'", "degC": "K='1' offset='273.15'",
}  # fmt: skip
KINDS = [
    "fine",
    "crash",
    "hang",
    "leak",
    "print",
    "exit",
    "abort",
    "end_early",
    "error",
    "nan",
    "stack",
    "discard",
    "sleep",
    "mixed",
    "fatal",
]
BACKLASH = Source(
    "backlash.h", "{b4c71a5e-0000-4000-8000-00000000000b}", 0.5,
    [
        V("m1", 0, start=0.4, unit="kg", least=0, text="motor mass"),
        V("m2", 1, start=0.9, unit="kg", least=0, text="load mass"),
        V("k", 2, start=8e4, unit="N/m", least=0, text="stiffness of the contact"),
        V("c", 3, start=15, unit="N.s/m", least=0, text="damping of the contact"),
        V("gap", 4, start=2e-4, unit="m", least=0, most=1e-3, text="backlash"),
        V("F", 5, start=12, unit="N", text="amplitude of the force"),
        V("v0", 6, start=0, unit="m/s"),
        *states("x1", "v1", "x2", "v2", first=7),
        V("peak", 15, "output", "continuous", unit="N", text="largest contact force"),
        V("position", 16, "output", "continuous", unit="m", text="the load's place"),
        V("impacts", 17, "output", "continuous"),
        V("material", 100, start=1, type="Enumeration"),
        V("teeth", 101, start=23, least=5, most=200, type="Integer"),
        V("damped", 200, start="true", type="Boolean"),
        V("drawing", 300, start="A-100", type="String"),
    ],
    indicators=2, enumeration=("Material", ("steel", "nylon")),
)  # fmt: skip
MODELS = {
    "Backlash": BACKLASH,
    "ForgetfulBacklash": Source(
        **{**vars(BACKLASH), "flags": ("-DRESET_BUG",)},
    ),
    "Trouble": Source(
        "trouble.h", "{7b0b1e00-0000-4000-8000-00000000000a}", 1.0,
        [
            V("x", 0, start=0.0), V("a", 1, start=2.0), V("b", 2, start=1.0),
            V("above", 3, start=1.0, text="x from where it misbehaves"),
            V("hang", 4, start=4.0, text="x from where mixed trials take for ever"),
            *states("z", first=5), *outputs(y=7),
            V("how", 100, start=1, type="Enumeration"),
            V("label", 300, start="x", type="String"),
        ],
        enumeration=("How", KINDS),
    ),
    "VanDerPol": Source(
        "vanderpol.h", "{5a0d3b0c-0000-4000-8000-00000000000c}", 20.0,
        [
            V("mu", 0, variability="tunable", start=5.0),
            V("x0", 1, start=2.0), V("v0", 2, start=0.0),
            *states("x", "v", first=3), *outputs(out=7, peak=8),
        ],
    ),
}  # fmt: skip


def attributes(**facts):
    facts = {k: v for k, v in facts.items() if v is not None and v != ""}
    return " ".join(f"{k}={quoteattr(str(v))}" for k, v in facts.items())


def description(name, model, fmi):
    """The modelDescription.xml of a model of ours."""
    two = fmi == 2
    state = "canGetAndSetFMUstate" if two else "canGetAndSetFMUState"
    token = {"guid" if two else "instantiationToken": model.token}
    lines = [
        "<?xml version='1.0' encoding='UTF-8'?>",
        "<fmiModelDescription "
        + attributes(
            fmiVersion=f"{fmi}.0", modelName=name, generationTool="tolstat tests",
            numberOfEventIndicators=model.indicators if two else None, **token,
        )
        + ">",
        f"<ModelExchange modelIdentifier='{name}' {state}='true'/>",
        f"<CoSimulation modelIdentifier='{name}' {state}='true' "
        "canHandleVariableCommunicationStepSize='true'/>",
        "<UnitDefinitions>",
        *(f"<Unit name='{u}'><BaseUnit {b}/></Unit>" for u, b in UNITS.items()),
        "</UnitDefinitions>",
    ]  # fmt: skip
    if model.enumeration:
        kind, words = model.enumeration
        items = "".join(
            f"<Item name='{word}' value='{i}'/>" for i, word in enumerate(words, 1)
        )
        lines.append(
            f"<TypeDefinitions><SimpleType name='{kind}'><Enumeration>{items}"
            "</Enumeration></SimpleType></TypeDefinitions>"
            if two
            else f"<TypeDefinitions><EnumerationType name='{kind}'>{items}"
            "</EnumerationType></TypeDefinitions>"
        )
    lines += [
        f"<DefaultExperiment startTime='0' stopTime='{model.stop}' tolerance='1e-6' "
        "stepSize='0.01'/>",
        "<ModelVariables>",
        *(_variable(v, model, two) for v in model.variables),
    ]
    if not two:
        lines += [
            f"<Float64 name='indicator_{i}' valueReference='{800 + i}' "
            "causality='local' variability='continuous'/>"
            for i in range(model.indicators)
        ]
    lines += ["</ModelVariables>", *_structure(model, two), "</fmiModelDescription>"]
    return "\n".join(lines)


def _variable(v, model, two):
    index = {v.reference: i for i, v in enumerate(model.variables, 1)}
    derivative = v.derivative_of
    if derivative is not None and two:
        derivative = index[derivative]
    outer = attributes(
        name=v.name, valueReference=v.reference, causality=v.causality,
        variability=v.variability, description=v.text,
    )  # fmt: skip
    if v.type == "String" and not two:
        return f"<String {outer}><Start value={quoteattr(v.start)}/></String>"
    inner = attributes(
        start=v.start, unit=v.unit, min=v.least, max=v.most, derivative=derivative,
        declaredType=model.enumeration[0] if v.type == "Enumeration" else None,
    )  # fmt: skip
    if two:
        return f"<ScalarVariable {outer}><{v.type} {inner}/></ScalarVariable>"
    kind = {"Real": "Float64", "Integer": "Int32"}.get(v.type, v.type)
    return f"<{kind} {outer} {inner}/>"


def _structure(model, two):
    index = {v.reference: i for i, v in enumerate(model.variables, 1)}
    outs = [v.reference for v in model.variables if v.causality == "output"]
    rates = [v.reference for v in model.variables if v.derivative_of is not None]
    if two:
        outs, rates = (
            "".join(f"<Unknown index='{index[r]}'/>" for r in references)
            for references in (outs, rates)
        )
        parts = [f"<Outputs>{outs}</Outputs><Derivatives>{rates}</Derivatives>"]
    else:
        parts = [f"<Output valueReference='{r}'/>" for r in outs]
        parts += [f"<ContinuousStateDerivative valueReference='{r}'/>" for r in rates]
        parts += [
            f"<EventIndicator valueReference='{800 + i}'/>"
            for i in range(model.indicators)
        ]
    return ["<ModelStructure>", *parts, "</ModelStructure>"]


def _missing(fmi):
    """Functions of the standard that the source lacks: FMPy demands all of them."""
    text = (headers() / f"fmi{fmi}FunctionTypes.h").read_text()
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    source = (SOURCES / f"fmi{fmi}.c").read_text()
    pattern = rf"typedef\s+fmi{fmi}Status\s+(fmi{fmi}\w+)TYPE\s*\(([^;]*)\);"
    return "\n".join(
        f"fmi{fmi}Status {name}({' '.join(arguments.split())})"
        f"{{ return fmi{fmi}Error; }}"
        for name, arguments in re.findall(pattern, text)
        if f" {name}(" not in source
    )


def without_library(name, fmi, folder):
    """An FMU that can be described, but not run; its path."""
    path = Path(folder, f"{name}{fmi}.fmu")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description(name, MODELS[name], fmi))
    return path


def build(name, fmi, folder):
    """Build a model of ours as an FMU; its path."""
    model = MODELS[name]
    with tempfile.TemporaryDirectory() as temporary:
        source, library = Path(temporary, "all.c"), Path(temporary, f"{name}.so")
        source.write_text(f'#include "fmi{fmi}.c"\n{_missing(fmi)}\n')
        subprocess.run(
            [*GCC, f"-I{headers()}", f"-I{SOURCES}", f'-DMODEL="{model.header}"',
             *model.flags, "-o", library, source, "-lm"], check=True,
        )  # fmt: skip
        path = Path(folder, f"{name}{fmi}.fmu")
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description(name, model, fmi))
            archive.write(library, f"binaries/{LIBRARIES[fmi]}/{name}.so")
    return path


def build_reference(name, fmi, folder):
    """Build a Reference-FMU of the Modelica Association; its path."""
    home = REFERENCE / name
    with tempfile.TemporaryDirectory() as temporary:
        library = Path(temporary, f"{name}.so")
        subprocess.run(
            [*GCC, "-DDISABLE_PREFIX", f"-DFMI_VERSION={fmi}", f"-I{headers()}",
             f"-I{REFERENCE}", f"-I{home}", "-o", library,
             REFERENCE / f"fmi{fmi}Functions.c", REFERENCE / "cosimulation.c",
             home / "model.c", "-lm"], check=True,
        )  # fmt: skip
        path = Path(folder, f"{name}{fmi}.fmu")
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(home / f"FMI{fmi}.xml", "modelDescription.xml")
            archive.write(library, f"binaries/{LIBRARIES[fmi]}/{name}.so")
    return path


if __name__ == "__main__":  # FOLDER NAME ...
    target, *names = sys.argv[1:]
    for name in names or MODELS:
        for fmi in (2, 3):
            print(build(name, fmi, target))
