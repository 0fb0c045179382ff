"""Models on the screen: which there are, and what one can be asked."""

from __future__ import annotations

from tolstat import catalogue
from tolstat.cli.showing import print_words, screen, words_table
from tolstat.errors import ModelError
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, offers
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Response
from tolstat.units.scale import scale_of


def list_models() -> None:
    """Print the names and titles of all models."""
    table = words_table("", "model", "title")
    for name in catalogue.names():
        try:
            table.add_row(name, catalogue.find(name).title)
        except ModelError as error:  # a package that is broken breaks no other
            table.add_row(name, str(error))
    print_words(table)


def show_model(name: str) -> None:
    """Print what a model can be given, what it answers and what it can show."""
    model = catalogue.find(name)
    console = screen()
    console.print(f"{model.name}: {model.title}", style="bold")
    _print_settings(model)
    description = described(model, model_settings.make(model))
    _print_contributors(description.contributors)
    _print_responses(description.responses)
    if offers(model):
        table = words_table("views", "view", "")
        for offer in offers(model).values():
            table.add_row(offer.name, offer.sentence)
        print_words(table)
    for word, required in model.failures.items():
        console.print(f"a trial may end as: {word} (required: {required})")


def _print_contributors(contributors: tuple[Contributor, ...]) -> None:
    heads = ("contributor", "unit", "symbol", "", "nominal", "equation")
    table = words_table("contributors: deviations", *heads)
    for part in contributors:
        unit = "relative" if part.unit == "1" else part.unit
        cells = (unit, part.symbol, part.sentence, _nominal(part), part.source)
        table.add_row(part.name, *cells)
    print_words(table)


def _print_responses(responses: tuple[Response, ...]) -> None:
    heads = ("response", "unit", "symbol", "", "equation")
    table = words_table("responses", *heads)
    for each in responses:
        unit = each.shown if each.unit == "1" and each.shown else each.unit
        cells = (unit, each.symbol, each.sentence, each.source)
        table.add_row(each.name, *cells)
    print_words(table)


def _print_settings(model: Model) -> None:
    """Print the settings, each with its default and what is allowed."""
    declared = model_settings.settings_of(model)
    if not declared:
        return
    heads = ("setting", "default", "allowed", "")
    table = words_table("settings", *heads)
    for each in declared.values():
        cells = (each.kind.words(each.default), each.kind.allowed, each.sentence)
        table.add_row(each.name, *cells)
    print_words(table)


def _nominal(part: Contributor) -> str:
    """Say what a grade or a class of gears refers to."""
    scale = scale_of("m")
    if part.gear:
        return f"gear of {scale.factor * part.gear.diameter:g} {scale.mark}"
    return f"{scale.factor * part.size:g} {scale.mark}" if part.size else ""
