"""Models: which there are, and what one is given, answers and shows."""

from __future__ import annotations

from collections.abc import Iterator

from tolstat import catalogue
from tolstat.document.blocks import Block, Column, Document, paragraph, table
from tolstat.document.inline import Name
from tolstat.errors import ModelError
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, offers
from tolstat.model.contract import Model
from tolstat.model.description import Contributor
from tolstat.units.scale import scale_of

SENTENCE = Column("", words=True)


def models_document() -> Document:
    """Return the names and titles of all models."""
    rows = []
    for name in catalogue.names():
        try:
            rows.append((name, catalogue.find(name).title))
        except ModelError as error:  # a package that is broken breaks no other
            rows.append((name, str(error)))
    return Document("", (table(("model", Column("title", words=True)), rows),))


def model_document(name: str) -> Document:
    """Return the settings, contributors, responses, views and failures of a model."""
    model = catalogue.find(name)
    return Document(f"{model.name}: {model.title}", tuple(_blocks(model)))


def _blocks(model: Model) -> Iterator[Block]:
    settings = [
        (Name(each.name), each.kind.words(each.default), each.kind.allowed,
         each.sentence)
        for each in model_settings.settings_of(model).values()
    ]  # fmt: skip
    words = Column("default", words=True), Column("allowed", words=True), SENTENCE
    if settings:
        yield table(("setting", *words), settings, "settings")
    contributors, responses = described(model, model_settings.make(model))
    parts = [
        (Name(part.name), "relative" if part.unit == "1" else part.unit, part.symbol,
         part.sentence, _nominal(part), part.source)
        for part in contributors
    ]  # fmt: skip
    heads = "contributor", "unit", "symbol", SENTENCE
    more = Column("nominal", words=True), Column("equation", words=True)
    yield table((*heads, *more), parts, "contributors: deviations")
    answered = [
        (Name(each.name), each.shown if each.unit == "1" and each.shown else each.unit,
         each.symbol, each.sentence, each.source)
        for each in responses
    ]  # fmt: skip
    yield table(("response", *heads[1:], more[1]), answered, "responses")
    if offered := offers(model):
        rows = [(each.name, each.sentence) for each in offered.values()]
        yield table(("view", SENTENCE), rows, "views")
    for word, required in model.failures.items():
        yield paragraph(f"a trial may end as: {word} (required: {required})")


def _nominal(part: Contributor) -> str:
    """Say what a grade or a class of gears refers to."""
    scale = scale_of("m")
    if part.gear:
        return f"gear of {scale.factor * part.gear.diameter:g} {scale.mark}"
    return f"{scale.factor * part.size:g} {scale.mark}" if part.size else ""
