"""A trial as an animation: a page that moves, or a GIF."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tolstat import catalogue
from tolstat.answers.answer import in_frame
from tolstat.answers.output_file import save
from tolstat.arrays import Array
from tolstat.document.blocks import Animated, Document, paragraph
from tolstat.document.scene import Scene, scene_of
from tolstat.errors import ModelError, TolstatError
from tolstat.model.checked_views import mechanism_of
from tolstat.model.contract import Model

ANIMATIONS = (".html", ".gif")


@dataclass(frozen=True, repr=False)
class Animation:
    """The mechanism of a trial in motion, before that of the nominal trial."""

    title: str
    sentence: str  # what is seen
    scene: Scene

    def document(self) -> Document:
        """Return its document: one figure."""
        moving = Animated(f"{self.title}, in motion", self.scene)
        lead = [paragraph(self.sentence)] if self.sentence else []
        return Document(self.title, (*lead, moving))

    def html(self) -> str:
        """Return it as a self-contained page."""
        from tolstat.render.page import page  # seldom needed

        return page(self.document())

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write it to a file: .html or .gif, by its ending.

        Raises
        ------
        RunFileError
            If the ending is not allowed, or the file cannot be written or replaced.
        """
        return save(path, "an animation", {".html": self.html, ".gif": self._gif})

    def _gif(self) -> bytes:
        from tolstat.render.gif import gif  # seldom needed

        return gif(self.scene, self.title)

    def __repr__(self) -> str:
        """Return a description in one line."""
        return f"<tolstat animation: {self.title}, {len(self.scene.points)} frames>"

    def _repr_html_(self) -> str:
        """Show it in a notebook, in a frame."""
        return in_frame(self.html())


def animation_of(
    model: Model, settings: Any, deviations: Array, title: str, *, nominal: bool
) -> Animation:
    """Return a trial of deviations[contributor], SI, in motion; or the nominal one.

    Raises
    ------
    ModelError
        If the model has no mechanism, or the trial cannot be built or failed at once.
    """
    check_animates(model)
    unit = mechanism_of(model, deviations, settings)
    other = None
    if not nominal:
        other = mechanism_of(model, np.zeros_like(deviations), settings)
        if other.points.shape != unit.points.shape:
            raise model.fault(
                "its mechanism has other frames or points in this trial than in the "
                "nominal one"
            )
    scene = scene_of(unit, other)
    if not len(scene.points):
        raise ModelError(f"{title}: no frame has an answer to animate")
    return Animation(title, unit.sentence, scene)


def check_animates(model: Model) -> None:
    """Refuse a model without a mechanism; name those that have one.

    Raises
    ------
    ModelError
        If it has none.
    """
    if model.animates:
        return
    others = []
    for name in catalogue.names():
        with suppress(TolstatError):
            if catalogue.find(name).animates:
                others.append(name)
    raise model.fault(
        f"it has no points and lines to animate; these have: {', '.join(others)}"
    )
