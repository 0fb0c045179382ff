"""Models: their list, and settings, contributors, responses and views of one."""

from tolstat import catalogue
from tolstat.document.blocks import Document, Given, paragraph, shown, table_of
from tolstat.document.inline import Name
from tolstat.errors import ModelError
from tolstat.model import settings as model_settings
from tolstat.model.checked import described
from tolstat.model.checked_views import offers
from tolstat.model.description import Contributor
from tolstat.units.scale import scale_of

TYPED = {"1": "%", "rad": "deg"}  # on drawings, other than in tables of results


def models_document() -> Document:
    """Return the names and titles of all models."""
    rows = []
    for name in catalogue.names():
        try:
            title = catalogue.find(name).title
        except ModelError as error:  # a broken package hides no other model
            title = str(error)
        rows.append({"model": name, "title": title})
    return Document("", (table_of(rows, words=["title"]),))


def model_document(name: str) -> Document:
    """Return the settings, contributors, responses, views and failures of a model."""
    model = catalogue.find(name)
    contributors, responses = described(model, model_settings.make(model))
    words = ["", "default", "allowed", "nominal", "equation"]
    tables: dict[str, list[dict[str, Given]]] = {
        "settings": [
            {"setting": Name(item.name), "default": item.kind.words(item.default),
             "allowed": item.kind.allowed, "": item.sentence}
            for item in model_settings.settings_of(model).values()
        ],
        "contributors: deviations": [
            {"contributor": Name(part.name),
             "unit": TYPED.get(part.unit) or scale_of(part.unit).mark,
             "symbol": part.symbol, "": part.sentence, "nominal": _nominal(part),
             "equation": part.source}
            for part in contributors
        ],
        "responses": [
            {"response": Name(item.name),
             "unit": scale_of(item.unit, item.shown).shown,
             "symbol": item.symbol, "": item.sentence, "equation": item.source}
            for item in responses
        ],
        "views": [
            {"view": item.name, "": item.sentence}
            for item in offers(model).values()
        ],
    }  # fmt: skip
    ends = (
        paragraph(f"a trial may end as: {word} (required: {required})")
        for word, required in model.failures.items()
    )
    filled = (table_of(rows, title, words=words) for title, rows in tables.items())
    return Document(f"{model.name}: {model.title}", shown(*filled, *ends))


def _nominal(part: Contributor) -> str:
    """Return the size that a grade or a class of gears refers to."""
    scale, gear = scale_of(part.unit, part.shown), "gear of " * bool(part.gear)
    size = part.gear.diameter if part.gear else part.size
    return f"{gear}{scale.number(size)} {scale.mark}" if size else ""
