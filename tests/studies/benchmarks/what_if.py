"""Twenty what-ifs against twenty fresh runs, with other seeds.

python -m tests.studies.benchmarks.what_if            # all, a few minutes; prints a table

A what-if holds where its interval and that of the fresh run have a number in common. All
machines but the stand are cheap: their fresh runs have ten times the trials.
"""

from __future__ import annotations

import sys
import tempfile
import tomllib
from pathlib import Path
from typing import NamedTuple

import tolstat
from tolstat.answers.report.summaries import summaries_of
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.catalogue import load as load_machine
from tolstat.statistics.estimate import Estimate

ROOT = Path(__file__).parents[3]
STACK = """\
model = "stack"
trials = {trials}
seed = {seed}
[deviations]
housing = {housing}
part_1 = {part_1}
part_2 = {part_2}
part_3 = {part_3}
[correlation]
{together}
[limits]
gap = {{ limit = "0.02..0.20 mm", yield = "95 %" }}
"""
AS_DRAWN = {
    "housing": '"+-0.05 mm"',
    "part_1": '"+-0.04 mm"',
    "part_2": '{ tolerance = "+-0.05 mm", distribution = "uniform" }',
    "part_3": '{ tolerance = "+-0.04 mm", distribution = "triangular" }',
}
TOGETHER = "part_1 = { housing = 0.5 }"


class Case(NamedTuple):
    """What is asked of which machine: lines of [deviations], as TOML has them."""

    machine: str
    words: str
    asked: dict[str, str]


def _tolerance(text: str, kind: str = "normal", more: str = "") -> str:
    return f'{{ tolerance = "{text}", distribution = "{kind}"{more} }}'


CASES = (
    Case("stack", "narrower", {"housing": '"+-0.025 mm"'}),
    Case("stack", "two narrower", {"housing": '"+-0.03 mm"', "part_1": '"+-0.02 mm"'}),
    Case("stack", "shifted", {"housing": _tolerance("+-0.05 mm", more=', shift = "10 um"')}),
    Case("stack", "wider", {"part_1": '"+-0.048 mm"'}),
    Case("stack", "better process", {"housing": _tolerance("+-0.05 mm", more=", cp = 1.67")}),
    Case("stack", "another distribution", {"part_2": _tolerance("+-0.05 mm", "triangular")}),
    Case("stack", "narrower, another", {"part_2": _tolerance("-0.02..0.04 mm", "trapezoidal")}),
    Case("stack", "screened", {
        "part_1": _tolerance("+-0.03 mm", "truncated_normal", ', outside = "screened"')}),
    Case("stack", "three at once", {
        "housing": '"+-0.04 mm"', "part_2": _tolerance("+-0.04 mm", "triangular"),
        "part_3": _tolerance("+-0.03 mm", "uniform")}),
    Case("correlated", "one narrower", {"part_1": '"+-0.03 mm"'}),
    Case("correlated", "both narrower", {"housing": '"+-0.03 mm"', "part_1": '"+-0.03 mm"'}),
    Case("correlated", "shifted", {"part_1": _tolerance("-0.03..0.05 mm")}),
    Case("batch", "all alike, narrower", {"part": '"+-0.02 mm"'}),
    Case("batch", "all alike, another", {"part": _tolerance("+-0.035 mm", "triangular")}),
    Case("half of a batch", "narrower", {"part": '"+-0.025 mm"'}),
    Case("wave-gear", "two narrower", {
        "R_out": _tolerance("+-0.010 mm", "uniform"),
        "e": _tolerance("+-0.010 mm", "triangular")}),
    Case("khpt75", "rods halved", {"rod_length": '"+-0.6 mm"'}),
    Case("khpt75", "radii halved", {"crank_radius": '"+-0.25 mm"'}),
    Case("khpt75", "friction narrower", {
        "friction": _tolerance("-10..+20 %", "triangular", ', mode = "0 %"')}),
    Case("khpt75", "shifted", {"rod_length_1": _tolerance("-0.9..+1.5 mm")}),
)  # fmt: skip


def study_of(machine: str, trials: int, seed: int) -> dict:
    """Return the study of a machine as it is drawn."""
    if machine in ("stack", "correlated", "batch", "half of a batch"):
        lines = dict(AS_DRAWN)
        together = TOGETHER if machine == "correlated" else ""
        text = STACK.format(trials=trials, seed=seed, together=together, **lines)
        study = tomllib.loads(text)
        if "batch" in machine:
            for i in (1, 2, 3):
                del study["deviations"][f"part_{i}"]
            common = True if machine == "batch" else 0.5
            study["deviations"]["part"] = {"tolerance": "+-0.035 mm", "common": common}
        return study
    study = tomllib.loads((ROOT / f"runs/{machine}.toml").read_text())
    return study | {"trials": trials, "seed": seed}


def fresh_of(case: Case, trials: int, seed: int) -> dict:
    """Return the study of what is asked."""
    study = study_of(case.machine, trials, seed)
    for name, line in asked_of(case).items():
        if "links" in study:
            study["links"][name] |= line
            continue
        drawn = study["deviations"].pop(name, None)
        if drawn is None:  # one of two that share a line
            general, _, number = name.rpartition("_")
            other = f"{general}_{3 - int(number)}"
            study["deviations"][other] = study["deviations"].pop(general)
        if isinstance(drawn, dict) and "common" in drawn:
            line = {"tolerance": line} if isinstance(line, str) else line
            line = line | {"common": drawn["common"]}
        study["deviations"][name] = line
    return study


def asked_of(case: Case) -> dict:
    """Return what is asked as a study has it."""
    text = "\n".join(f"{name} = {line}" for name, line in case.asked.items())
    return tomllib.loads(text)


class Answer(NamedTuple):
    """A number as run, with what-if, and of the fresh run."""

    words: str
    as_run: Estimate
    what_if: Estimate
    fresh: Estimate

    @property
    def holds(self) -> bool | None:
        """Whether the intervals have a number in common; None without one."""
        if not (self.what_if.sure and self.fresh.sure):
            return None
        return (
            self.what_if.lower <= self.fresh.upper
            and self.fresh.lower <= self.what_if.upper
        )


def compared(cases, folder, trials=4096, more=10):
    """Yield case, effective trials and the answers of each.

    Parameters
    ----------
    cases : sequence of Case
        What is asked.
    folder : Path
        Takes the runs.
    trials : int
        Of the stored runs.
    more : int
        Times as many in fresh runs of all but the stand.
    """
    load_machine(str(ROOT / "runs/own/stack.py:Stack"))
    runs = {}
    for place, case in enumerate(cases):
        if case.machine not in runs:
            study, path = study_of(case.machine, trials, 75), f"{case.machine}.h5"
            runs[case.machine] = tolstat.run(study, output=folder / path)
        found = tolstat.what_if(runs[case.machine], asked_of(case), evaluate=False)
        many = trials if case.machine == "khpt75" else more * trials
        study = fresh_of(case, many, 1000 + place)
        fresh = tolstat.run(study, output=folder / f"fresh-{place}.h5")
        own, answers = summaries_of(drawn_trials(fresh)), []
        for name, each in found.responses.items():
            if not each.scenario.limited:
                continue
            three = each.baseline, each.scenario, own[name]
            beyond = (of.limited.yields.fraction_out_of_limit for of in three)
            answers.append(Answer(f"{name} beyond", *beyond))
            answers.append(Answer(f"{name} mean", *(of.mean for of in three)))
            answers.append(Answer(f"{name} sigma", *(of.sigma for of in three)))
            for share in (0.05, 0.5, 0.95, 0.99):
                numbers = (of.quantiles[share] for of in three)
                answers.append(Answer(f"{name} {100 * share:g} %", *numbers))
            numbers = (of.limited.moments.ppk for of in three)
            answers.append(Answer(f"{name} Ppk", *numbers))
        yield case, found.effective_sample_size, answers


def _words(estimate: Estimate, factor: float = 1e6) -> str:
    value, lower, upper = (f"{factor * each:.0f}" for each in estimate[:3])
    return f"{value} ({lower} .. {upper})" if estimate.sure else "none"


def main():
    """Print a line for each case: machines beyond, and how many intervals hold."""
    print("| machine | what if | effective | response | beyond per million as run | "
          "what if | fresh run | intervals that hold |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    disjoint = []
    with tempfile.TemporaryDirectory() as folder:
        for case, effective, answers in compared(CASES, Path(folder)):
            told = [each for each in answers if each.holds is not None]
            held = sum(bool(each.holds) for each in told)
            first = answers[0]
            numbers = (_words(each) for each in first[1:])
            print(
                f"| {case.machine} | {case.words} | {effective} | "
                f"{first.words.split()[0]} | {' | '.join(numbers)} | "
                f"{held} of {len(told)} |",
                flush=True,
            )
            disjoint += [(case, each) for each in told if not each.holds]
    for case, each in disjoint:
        print(case.machine, case.words, each)
    return bool(disjoint)


if __name__ == "__main__":
    sys.exit(main())
