"""A model that its audit doubts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tolstat import Contributor, Description, Model, Outcome, Response, setting


@dataclass(frozen=True)
class CliffSettings:
    rtol: float = setting(1e-3, "how roughly it is integrated", above=0.0)


class Cliff(Model):
    """A force wrong by 1 N beyond 12.5 N, else by 1 mN; another errs with it."""

    name = "cliff"
    settings = CliffSettings

    def describe(self, settings):
        parts = tuple(Contributor(f"part_{i}", "m") for i in (1, 2))
        return Description(parts, (Response("force", "N"), Response("other", "N")))

    def evaluate(self, deviations, settings):
        force = 10 + 1e3 * deviations[:, 0]
        error = settings.rtol * np.where(force > 12.5, 1e3, np.sin(1e3 * force))
        other = 1e3 * deviations[:, 1] + error
        status = np.where(deviations[:, 1] > 2.9e-3, 4, 1)
        return Outcome(np.stack([force + error, other], axis=1), status)


class Fragile(Model):
    """Ends a trial far out as it is evaluated more precisely: one that takes long."""

    name = "fragile"
    settings = CliffSettings

    def describe(self, settings):
        return Description((Contributor("part", "m"),), (Response("force", "N"),))

    def evaluate(self, deviations, settings):
        force = 10 + 1e3 * deviations[:, 0]
        long = (settings.rtol < 1e-3) & (np.abs(force - 10) > 2)
        return Outcome(force[:, None], np.where(long, 4, 1))
