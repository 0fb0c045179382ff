"""The cheapest tolerances that meet all limits: found by weighting, proved afresh."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from numbers import Integral
from pathlib import Path

import numpy as np

from tolstat.answers.allocate.active_limits import active, lines_of
from tolstat.answers.allocate.allocation import Allocation, Scheme, trade_off
from tolstat.answers.allocate.fresh_runs import LONGEST, FreshRuns, Proof
from tolstat.answers.allocate.search import Searching
from tolstat.answers.allocate.trade_off import (
    at_the_cost_drawn,
    linear_answers,
    own_shares,
    points_about,
)
from tolstat.catalogue import place_of
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.errors import DistributionError, StudyError
from tolstat.execution.run_loop import Progress, Telling
from tolstat.execution.workers.crew import Workers
from tolstat.literal import visible
from tolstat.model.contract import Model
from tolstat.statistics.limits.anytime_valid import anytime_valid
from tolstat.statistics.limits.sample_size import grown
from tolstat.statistics.limits.yields import CONFIDENCE
from tolstat.store.commands import command
from tolstat.study.cost_entry import EXAMPLE
from tolstat.study.memory_needed import too_large
from tolstat.study.study import Source, Study, load

ENOUGH = 50  # machines that would be beyond a limit if as many were as it permits
LONGER = 32  # times as many trials as these take, where they are worth a longer proof
QUICK, MANY = 256, 2_000_000  # where nothing is integrated, up to so many trials


def allocate(
    study: Source,
    *,
    trials: int | None = None,
    workers: int | None = None,
    model: Model | None = None,
    progress: Telling | None = None,
    executor: Executor | None = None,
) -> Allocation:
    """Find the cheapest tolerances with which a study meets all its limits.

    Parameters
    ----------
    study : path or mapping
        A study file, or what one would hold; lines of [deviations] have a `cost`.
    trials : int, optional
        Of the wide run, and of each proof at its first look; else as many as the
        strictest limit needs, or as the study has if these are more.
    workers, model, progress, executor
        As of `tolstat.run`.

    Returns
    -------
    Allocation
        `.text` is the study that it found. Nothing is stored.

    Raises
    ------
    StudyError
        If the study is wrong, draws nothing, has no limit or no cost.
    """
    asked = load(study, model=model)
    with Workers(workers, executor=executor) as crew:
        return allocated(asked, crew, trials=trials, progress=progress)


def allocated(
    study: Study,
    workers: Workers,
    *,
    trials: int | None = None,
    progress: Telling | None = None,
    output: Path | None = None,
) -> Allocation:
    """Allocate the tolerances of a checked study; see `allocate`.

    `output` is the file that the study found goes to: its comment names it.
    """
    _check(study)
    if trials is not None and not (isinstance(trials, Integral) and trials > 0):
        raise StudyError(f"trials: a whole number from 1 on is expected, not {trials}")
    strictest = min(study.limits, key=lambda name: -study.limits[name].demanded)
    share = 1 - study.limits[strictest].demanded
    enough = math.ceil(ENOUGH / share)
    count = trials or max(study.trials, enough)
    most = LONGEST * count
    if wrong := too_large(most, study.description):
        source = study.path or "the study"
        raise StudyError(
            f"{source}: a proof may take {LONGEST} times {count} trials: {wrong}; ask "
            "for fewer (--trials), or demand less of the limits"
        )
    longest = LONGER * min(count, enough)
    if not study.model.integrates:
        longest = max(longest, min(QUICK * min(count, enough), MANY))
    longest = max(most, longest)
    if too_large(longest, study.description):
        longest = most  # an answer does without
    shown = anytime_valid(0, most, CONFIDENCE).upper  # with none beyond
    asks = f"{strictest} may have {1e6 * share:.6g} ppm beyond"
    least = 1
    while (open_to := anytime_valid(0, LONGEST * least, CONFIDENCE).upper) > share:
        least = grown(least * open_to / share)
    if shown > share:
        raise StudyError(
            f"{study.path or 'the study'}: {asks}, which no first proof of {most} "
            f"machines, {LONGEST} times --trials, can show, though none of them be "
            f"beyond: ask for {least} trials or more"
        )
    tell = progress or (lambda progress: None)
    takes = (
        f"{asks}: a wide run and several fresh ones have {count} machines each, a "
        f"proof up to {most}"
    )
    if longest > most:
        takes += f", or {longest} where the cost is worth it"
    if count > study.trials and not trials:
        takes += f" (--trials for fewer, {least} at least)"
    tell(Progress(0, 0, count, doubt=takes))
    again = partial(_again, study, trials, output)
    return _around(Searching(FreshRuns(study, workers, count, tell)), longest, again)


def _check(study: Study) -> None:
    """Refuse what has nothing to be allocated, or cannot be weighted."""
    source = study.path or "the study"
    if study.sampler is None:
        raise StudyError(
            f'{source}: sampling = "{study.sampling}" draws nothing; tolerances are '
            "allocated to machines that are drawn"
        )
    if not study.limits:
        raise StudyError(
            f"{source} has no [limits]: without them the loosest tolerances are the "
            "cheapest; say what is permitted, and of how many machines"
        )
    deviating = study.deviating
    if not deviating.priced:
        raise StudyError(
            f"{source}: no line of [deviations] or [links] says what it costs by its "
            f"tolerance; give one or more of them cost = {EXAMPLE}"
        )
    nowhere = {name: np.zeros(1) for name in deviating.distributions}
    for line in deviating.priced:
        tightest, loosest = map(line.distributions, line.ends)
        drawn = {**deviating.distributions, **loosest}
        try:
            DensityRatio(nowhere, drawn, deviating.dependence).weights(tightest)
        except DistributionError as error:
            raise StudyError(
                f"{source}: {line.name} has a cost, and cannot be weighted: {error}; "
                "leave its cost out, or give it another distribution"
            ) from None


def _around(
    search: Searching, longest: int, again: Callable[[Proof], tuple[str, str]]
) -> Allocation:
    """Prove the cheapest tolerances, and look around."""
    runs = search.runs
    search.draw_wide()
    proof = search.proved()
    linear = linear_answers(search)
    ways = [*([proof.choice] if proof else []), *linear.values()]
    proof = search.stretched(ways, proof, longest)
    # nothing was chosen by the run of this seed: one that was met is a lucky one
    seed = search.next_seed()
    answer = (
        proof
        or search.at_tightest
        or runs.of(search.tightest, search.next_seed(), most=runs.longest)
    )
    proof = answer if answer.met else None
    found = answer.choice
    proofs = {"as drawn": runs.of(search.drawn, seed)}
    proofs |= {"found": runs.of(found, seed)} if proof else {"tightest": answer}
    points = points_about(search, found)
    if proof:
        proofs["at the cost drawn"] = at_the_cost_drawn(search, points, seed)
    proofs |= {name: runs.of(each, seed) for name, each in linear.items()}
    schemes = {name: each.scheme for name, each in proofs.items()}
    listed = not any(each.law for each in search.priced)
    return Allocation(
        met=proof is not None,
        cost=answer.scheme.cost,
        tolerances=answer.scheme.halves,
        lines=lines_of(search, answer),
        schemes=schemes,
        proof=answer.scheme,
        again=runs.study.sampling == "random",
        verdicts={name: each.verdict for name, each in answer.yields.items()},
        active=active(search, found),
        notes=tuple(search.notes),
        wide_run=search.drawn_wide,
        fresh_runs=runs.made,
        curve=trade_off(
            own_shares(search, points) if listed else points,
            schemes | ({"found": answer.scheme} if proof else {}),
            listed=listed,
        ),
        text=runs.text(found, _heading(answer, schemes, *again(answer))),
    )


def _again(
    study: Study, trials: int | None, output: Path | None, answer: Proof
) -> tuple[str, str]:
    """Return the commands that find and prove it once more; empty where none does."""
    scheme, machine = answer.scheme, place_of(study.model)
    found = proved = ""
    if study.path:
        options = ["--trials", trials] if trials else []
        found = command("allocate", study.path, *options, machine=machine)
    if output and study.sampling == "random":
        proved = to_prove_again(output, scheme, machine)
    return visible(found), visible(proved)


def to_prove_again(output: Path, proof: Scheme, machine: str) -> str:
    """Return the command that makes the proof of a written study once more."""
    options = "--trials", proof.trials, "--seed", proof.seed
    return command("run", output, *options, machine=machine)


def _heading(answer: Proof, schemes: dict[str, Scheme], found: str, proved: str) -> str:
    """Say above a study where its tolerances come from."""
    scheme, drawn = answer.scheme, schemes["as drawn"]
    shown = "meet every limit" if answer.met else "do NOT meet every limit"
    return "\n".join(
        [
            f"Tolerances allocated, at a cost of {scheme.cost:.6g} (as drawn "
            f"{drawn.cost:.6g})" + (":" if found else "."),
            *([found] if found else []),
            f"They {shown} in a run of {scheme.trials} random machines with seed "
            f"{scheme.seed}" + (":" if proved else "."),
            *([proved] if proved else []),
        ]
    )
