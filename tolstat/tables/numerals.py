"""Numbers as people and programs write them, and the decimal sign that they prove.

A cell proves a decimal sign where it can be read in one way only: 1.234,5 and 20,01 and
0,123 have a decimal comma, 1,234.5 and 1 234.5 a point. 20,001 is either twenty or
twenty thousand. One sign holds for a whole file.
"""

import re
from collections.abc import Iterable
from enum import Enum

from tolstat.errors import DataError, UnitError
from tolstat.units.grammar import bare_number
from tolstat.units.typography import MINUS

POINT, COMMA = ".", ","
OTHER = {POINT: COMMA, COMMA: POINT}
NAMES = {POINT: "decimal point", COMMA: "decimal comma"}
MISSING = frozenset({"", "-", "--", "n/a", "na", "nan", "#n/a", "none", "null"})
_GAPS = "'’ \u00a0\u2009\u202f"  # between thousands, whatever the decimal sign
_EXPONENT = r"[eEdD][+-]?\d+"
_DIGITS = rf"\d[\d.,{_GAPS}]*|[.,]\d+"
NUMERAL = rf"[+\-{MINUS}]?(?:{_DIGITS})(?:{_EXPONENT})?"  # what may be a number
_SIGNED = re.compile(rf"[+\-{MINUS}]?(?P<body>.*?)(?P<exponent>{_EXPONENT})?")
_BODY = re.compile(_DIGITS)
_GAPPED = re.compile(rf"\d{{1,3}}([{_GAPS}])\d{{3}}(?:\1\d{{3}})*(?P<rest>[.,]\d*)?")


_WHOLE = re.compile(r"[+-]?[0-9]+")


class Proof(Enum):
    """What a cell proves about the decimal sign of its file."""

    POINT = POINT
    COMMA = COMMA
    NOTHING = ""  # a whole number
    EITHER = "either"  # 1.234 or 20,001
    NO_NUMBER = "no number"


def is_missing(text: str) -> bool:
    """Return whether a cell says that there is no number."""
    return text.strip().casefold() in MISSING


def proof(text: str) -> Proof:
    """Return what a text proves, taken as one number.

    Examples
    --------
    >>> [proof(text).value for text in ("20,01", "1,234.5", "20,001", "17", "24.12.25")]
    [',', '.', 'either', '', 'no number']
    """
    match = _SIGNED.fullmatch(text.strip())
    if not match or not _BODY.fullmatch(body := match["body"]):
        return Proof.NO_NUMBER
    if any(gap in body for gap in _GAPS):
        gapped = _GAPPED.fullmatch(body)
        return Proof((gapped["rest"] or "")[:1]) if gapped else Proof.NO_NUMBER
    signs = [sign for sign in body if sign in OTHER]
    if not signs:
        return Proof.NOTHING
    decimal = signs[-1]
    thousands = rf"[1-9]\d{{0,2}}(?:\{signs[0]}\d{{3}})+"
    if len({*signs}) == 2:
        fits = signs.count(decimal) == 1
        fits = bool(fits and re.fullmatch(rf"{thousands}\{decimal}\d*", body))
        return Proof(decimal) if fits else Proof.NO_NUMBER
    if len(signs) > 1:
        whole = re.fullmatch(thousands, body)
        return Proof(OTHER[decimal]) if whole else Proof.NO_NUMBER
    if re.fullmatch(thousands, body) and not match["exponent"]:
        return Proof.EITHER
    return Proof(decimal)


def is_torn(first: str, second: str) -> bool:
    """Return whether two cells may be one number, torn at its decimal comma."""
    return bool(_WHOLE.fullmatch(first)) and second.isdigit()


def settled_decimal(
    cells: Iterable[tuple[str, str]],
    *,
    between_commas: bool = False,
    source: str = "file",
) -> str:
    """Return the decimal sign of a file or a column; empty where no number has one.

    Parameters
    ----------
    cells : iterable of (str, str)
        Texts of numbers, each with its address.
    between_commas : bool
        Whether commas separate the columns: cells that prove nothing and hold no comma
        have a point.
    source : str
        "file" or "column", for messages.

    Raises
    ------
    DataError
        If two readings are possible.
    """
    proofs: dict[Proof, tuple[str, str]] = {}
    commas = False
    for text, address in cells:
        proved = proof(text)
        proofs.setdefault(proved, (text.strip(), address))
        commas |= proved is Proof.EITHER and COMMA in text
    if Proof.POINT in proofs and Proof.COMMA in proofs:
        first, address = proofs[Proof.POINT]
        second, other = proofs[Proof.COMMA]
        raise DataError(
            f"{address}: '{first}' has a decimal point; {other}: '{second}' has a "
            'decimal comma; correct one, or give decimal = "." or decimal = ","'
        )
    for sign in (Proof.POINT, Proof.COMMA):
        if sign in proofs:
            return str(sign.value)
    if Proof.EITHER not in proofs:
        return ""
    if between_commas and not commas:
        return POINT
    text, address = proofs[Proof.EITHER]
    readings = " or ".join(f"{number(text, sign):.10g}" for sign in (POINT, COMMA))
    raise DataError(
        f"{address}: '{text}' may be {readings}, and no other number of the {source} "
        'settles it; give decimal = "." or decimal = ","'
    )


def number(text: str, decimal: str) -> float:
    """Return the number that a text is with a decimal sign; a UnitError if none.

    Examples
    --------
    >>> number("1.234,5", ","), number("20,001", ".")
    (1234.5, 20001.0)
    """
    sign = decimal or POINT
    proved = proof(text)
    if proved in (Proof.NO_NUMBER, Proof(OTHER[sign])):
        raise UnitError(f"with a {NAMES[sign]} it is none")
    body = re.sub(f"[{_GAPS}]", "", text.strip()).replace(MINUS, "-")
    body = re.sub("[dD]", "e", body)  # as Fortran writes doubles
    return bare_number(body.replace(OTHER[sign], "").replace(sign, "."))
