"""A stack of four dimensions: the gap that is left in a housing by three parts.

tolstat run runs/own/stack.toml --machine runs/own/stack.py:Stack
"""

from dataclasses import dataclass

from tolstat import Contributor, Description, Model, Outcome, Response, setting


@dataclass(frozen=True)
class Settings:
    preload: float = setting(0.0, "how much the parts are pressed together", unit="m")


class Stack(Model):
    name = "stack"
    title = "gap between a housing and the three parts in it"
    settings = Settings
    failures = {"cannot be mounted": "the parts leave a gap"}

    def describe(self, settings):
        housing = Contributor("housing", "m", "H", "depth of the housing", size=0.100)
        parts = (
            Contributor(f"part_{i}", "m", f"l{i}", f"length of part {i}", size=0.033)
            for i in (1, 2, 3)
        )
        gap = Response("gap", "m", "g", "gap beside the parts", "H - l1 - l2 - l3")
        return Description((housing, *parts), (gap,))

    def evaluate(self, deviations, settings):
        housing, *parts = deviations.T  # float64[trial] each, SI
        gap = 0.1e-3 + settings.preload + housing - parts[0] - parts[1] - parts[2]
        return Outcome(gap[:, None], failed={"cannot be mounted": gap < 0})
