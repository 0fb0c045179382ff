"""Wrong verdicts of `tolstat decide`, and the trials that it takes.

Three limits at once on responses of known distributions, which share contributors:
a sum, a difference of two parts without its sign, and a cubic. Each is out of its limit
in `ratio` times as many units as permitted. One line for each cell:

python -m tests.studies.deciding [STUDIES] [RATIO ...] [--thinned] [--rare]

`--thinned`: as a slow model is decided, whose trials are thinned. `--rare`: also with
50 ppm permitted instead of 2700, so that trials far from limits are left out.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.execution.stages import SampledStages
from tolstat.execution.until_decided import UntilDecided
from tolstat.statistics.limits.limit import within
from tolstat.statistics.limits.yields import MET, NOT_MET, verdict
from tolstat.statistics.sample import Sample
from tolstat.study.sampling import deciding
from tolstat.study.study import load

PERMITTED, RARE, AT_MOST = 0.0027, 50e-6, 1_000_000
RATIOS = (0.5, 0.8, 1.25, 2.0)
STUDIES = 400


@dataclass(frozen=True)
class Nothing:
    unit: float = setting(1.0, "not used")


class Three(Model):
    """Three responses of four normal parts."""

    name = "three"
    title = "three responses of four parts"
    settings = Nothing

    def describe(self, settings):
        parts = tuple(
            Contributor(f"part_{i}", "m", f"l{i}", "a part", "all") for i in range(4)
        )
        names = ("sum", "jam", "cubic")
        return Description(
            parts, tuple(Response(n, "1", n, "a", "all", shown="1") for n in names)
        )

    def evaluate(self, deviations, settings):
        x = deviations / 1e-3
        jam = np.abs(x[:, 0] - x[:, 1]) / np.sqrt(2)
        columns = [x.sum(axis=1) / 2, jam, x[:, 2] + 0.2 * x[:, 2] ** 3]
        return Outcome(np.stack(columns, axis=1), np.ones(len(x), np.int64))


def limits_of(ratio, permitted=PERMITTED):
    """Return the limits that so many times as many units as permitted miss."""
    share = permitted * ratio
    end = -ndtri(share)
    ends = {"sum": end, "jam": -ndtri(share / 2), "cubic": end + 0.2 * end**3}
    limits = {name: f"<= {float(limit)!r}" for name, limit in ends.items()}
    if permitted == PERMITTED:
        return limits
    return {n: {"limit": x, "ppm": permitted * 1e6} for n, x in limits.items()}


def decided(seed, ratio, *, slow, permitted=PERMITTED):
    """Return the verdicts of a study, and its trials."""
    study = load(
        {
            "model": "three",
            "trials": deciding(AT_MOST, slow),
            "seed": seed,
            "deviations": {"part": "+-3 mm"},
            "limits": limits_of(ratio, permitted),
        },
        model=Three(),
    )
    trials, rule = SampledStages(study).trials, UntilDecided(study)
    while True:
        while stage := rule.next(trials):
            trials.add(stage)
            answers = study.model.evaluate(stage.deviations, study.settings)
            trials.take([(stage.first, answers)])
        if not rule.rows:
            break
        study = rule.lengthen(trials)
    (number,) = rule.stopped.stages
    trials = trials.first(number)
    sample = Sample(trials.status, thinned=trials.thinned).telling(permitted)
    verdicts = []
    for name, limit in study.limits.items():
        values = trials.response(name)[: len(sample.status)]
        share = sample.share(within(values, limit.permitted), sample.ran)
        verdicts.append(verdict(share, 1 - permitted))
    return verdicts, number


def main(studies=STUDIES, ratios=RATIOS, **keys):
    """Print a row for each cell."""
    print("| ratio | wrong, % of verdicts | undecided | trials, median | 90 % |")
    print("|---|---|---|---|---|")
    for ratio in ratios:
        found = [decided(seed, ratio, **keys) for seed in range(studies)]
        verdicts = [one for several, _ in found for one in several]
        right = MET if ratio < 1 else NOT_MET
        wrong = [one in (MET, NOT_MET) and one != right for one in verdicts]
        open_ = [one not in (MET, NOT_MET) for one in verdicts]
        half, most = np.quantile([number for _, number in found], [0.5, 0.9])
        print(
            f"| {ratio} | {100 * np.mean(wrong):.2f} | {100 * np.mean(open_):.1f} % | "
            f"{half:.0f} | {most:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    numbers = [x for x in sys.argv[1:] if not x.startswith("--")]
    chosen = [float(x) for x in numbers[1:]] or RATIOS
    keys = {"slow": {"--thinned", "--rare"} & {*sys.argv} != set()}
    keys["permitted"] = RARE if "--rare" in sys.argv else PERMITTED
    main(int(numbers[0]) if numbers else STUDIES, chosen, **keys)
