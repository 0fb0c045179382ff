"""Settings of an FMU: how trials are simulated, and a class for all of them."""

from __future__ import annotations

import dataclasses
import math
from functools import partial
from typing import Any

from tolstat.errors import ModelError
from tolstat.fmu.model_xml import FmuFile
from tolstat.model.contract import Model
from tolstat.model.settings import setting

STOP, STEPS, RTOL = 1.0, 500, 1e-6  # s; where the default experiment does not say


def start_of(file: FmuFile) -> float:
    """Return the time at which trials begin, s."""
    start = file.experiment.start
    return 0.0 if math.isnan(start) else start


def method_settings(file: FmuFile) -> dict[str, Any]:
    """Return the settings of how trials are simulated, as fields, by name."""
    _, stop, step, rtol = file.experiment
    start = start_of(file)
    if not stop > start:
        stop = start + STOP
    if not 0 < step <= stop - start:
        step = (stop - start) / STEPS
    offered = [name for name in (file.co_simulation, file.model_exchange) if name]
    both = "; audits use it" if len(offered) > 1 else ""
    declared = partial(setting, group="how trials are simulated")
    return {
        "model_exchange": declared(
            not file.co_simulation,
            "whether CVode integrates the FMU's rates; false is co-simulation, where "
            f"the FMU integrates by itself{both}",
        ),
        "stop": declared(stop, "stop time", unit="s", above=start),
        "max_step": declared(
            step,
            "longest step, all equal in co-simulation; responses count each step's end",
            unit="s",
            above=0.0,
        ),
        "rtol": declared(
            rtol if 0 < rtol < 1 else RTOL,
            "tolerance of CVode; co-simulation is told of it",
            above=0.0,
            at_most=0.1,
        ),
        "new_instances": declared(
            False,
            "whether each trial has a new instance of the FMU; otherwise it is reset, "
            "and tolstat checks that it forgets nothing",
        ),
    }


def settings_class(model: Model, file: FmuFile, fields: dict[str, Any]) -> type:
    """Return the frozen dataclass of the settings of an FMU.

    Its instances go to other processes with their model, which has the class there.
    """

    def check(settings: Any) -> None:
        offered = file.model_exchange if settings.model_exchange else file.co_simulation
        if not offered:
            typed = str(not settings.model_exchange).lower()
            raise ModelError(
                f"{file.path.name} does not offer this; write model_exchange = {typed}"
            )
        span = settings.stop - start_of(file)
        if settings.max_step > span * (1 + 1e-9):  # but for rounding
            raise ModelError(
                f"max_step is {settings.max_step:.6g} s, longer than the whole time "
                f"up to stop, {span:.6g} s; write a shorter one"
            )

    def reduce(settings: Any) -> Any:
        return _restored, (model, vars(settings))

    return dataclasses.make_dataclass(
        "FmuSettings",
        [(name, type(field.default), field) for name, field in fields.items()],
        frozen=True,
        namespace={"__post_init__": check, "__reduce__": reduce},
    )


def _restored(model: Model, values: dict[str, Any]) -> Any:
    return model.settings(**values)
