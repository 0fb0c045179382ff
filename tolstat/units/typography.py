"""Signs of drawings, word processors and PDF files, turned into those of keys.

A sign is read where it can mean one thing, or refused by its name; none is dropped. A
dash stays one where it stands between two numbers: there it may be a minus, too.
"""

import re
import unicodedata

from tolstat.errors import UnitError

MINUS = "\N{MINUS SIGN}"  # as word processors write it
DASHES = "–—‒―"
_HYPHENS = f"{MINUS}\N{HYPHEN}\N{NON-BREAKING HYPHEN}﹣－"
_TIMES, _OVER, _PLUSES, _DEGREES = "·⋅∙", "÷∕⁄", "＋﹢", "º˚"


def _same(signs: str, key: str) -> dict[str, str]:
    return dict.fromkeys(signs, key)


_ARITHMETIC = {
    **_same(_HYPHENS, "-"), **_same(_PLUSES, "+"), **_same(_TIMES, "*"),
    **_same(_OVER, "/"), **_same(_DEGREES, "°"), "\N{OHM SIGN}": "Ω",
}  # fmt: skip
_OF_FORMULAS = str.maketrans({**_ARITHMETIC, **_same(DASHES, "-"), "×": "*"})
_OF_QUANTITIES = str.maketrans({
    **_ARITHMETIC, **_same("∅⌀øφΦϕ", "Ø"), **_same("′’ʹ", "'"), **_same("″”ʺ", '"'),
    "×": "x", "…": "..", "≤": "<=", "≥": ">=", "℃": "°C",
})  # fmt: skip
_INSTEAD = {"²": "**2", "³": "**3", "√": "sqrt(...)", "≤": "<=", "≥": ">=", "½": "0.5",
            "¼": "0.25", "¾": "0.75"}  # fmt: skip
_AUTOCAD = {"p": "±", "c": "Ø", "d": "°"}  # behind %%
_CONTROL = re.compile("%%([pcd])", re.IGNORECASE)
_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")
_POWER = re.compile("[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_DASH = re.compile(rf"(\s*)([{DASHES}])(\s*)")
_ENDS_NUMBER = re.compile(r"(?:[\w°'\"%)]|(?<!\.)\.)$")
_KNOWN = {*map(chr, range(32, 127)), *DASHES, *"µμ°Ω±Ø□"}


def typed_quantity(text: str) -> str:
    """Return a text of quantities by the signs of keys; µ, °, Ω, ± and Ø stay.

    A sign that is none of a quantity is a UnitError.
    """
    if not text.isascii():
        text = _one_line(text)
        text = _POWER.sub(lambda run: f"^{run[0].translate(_RAISED)}", text)
        text = text.translate(_OF_QUANTITIES)
        text = _DASH.sub(_minus_or_dash, text)
        check_signs(text, "of a quantity")
    if "%%" in text:
        text = _CONTROL.sub(lambda code: _AUTOCAD[code[1].lower()], text)
    return text.strip()


def typed_formula(text: str) -> str:
    """Return a formula in one line by the signs of keys; each keeps its place."""
    return text if text.isascii() else _one_line(text).translate(_OF_FORMULAS)


def typed_unit(text: str) -> str:
    """Return a unit by the signs of keys, its powers as ^2."""
    if text.isascii():
        return text
    text = _POWER.sub(lambda run: f"^{run[0].translate(_RAISED)}", text)
    return text.translate(_OF_QUANTITIES)


def check_signs(text: str, of_what: str, letters: str = "") -> None:
    """Refuse a sign that is none of a text, by its name: a UnitError."""
    for sign in text:
        if sign in _KNOWN or sign in letters:
            continue
        name = f"{unicodedata.name(sign, 'no name').lower()}, U+{ord(sign):04X}"
        if sign.isprintable():
            instead = f"write {_INSTEAD.get(sign, 'it with other signs')}"
            raise UnitError(f"'{sign}' ({name}) is no sign {of_what}; {instead}")
        raise UnitError(f"it holds a sign that cannot be seen ({name}); delete it")


def _minus_or_dash(match: re.Match[str]) -> str:
    """Return a minus where a dash can be nothing else: behind no number, or at one."""
    before, _, after = match.groups()
    between = bool(_ENDS_NUMBER.search(match.string[: match.start()]))
    return match[0] if between and (after or not before) else f"{before}-{after}"


def _one_line(text: str) -> str:
    return "".join(" " if sign.isspace() else sign for sign in text)
