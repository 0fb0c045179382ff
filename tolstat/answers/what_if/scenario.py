"""What if parts came from other distributions: the stored trials, weighted."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from shlex import quote
from typing import Any, NamedTuple

from tolstat.answers.relimit import with_limits
from tolstat.answers.report.gather import joint_findings, reportable
from tolstat.answers.report.summary_table import notes_of, reading_of, summaries_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.study_entries import run_that_tells
from tolstat.answers.what_if.what_if_answer import Asked, Changed, Weighed, WhatIf
from tolstat.deviations.density_ratio import DensityRatio, dependent_groups, equal_parts
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.names import expand
from tolstat.deviations.overlap import Overlap, check_overlap, overlap_of
from tolstat.errors import (
    DependenceError,
    DistributionError,
    PictureError,
    RunFileError,
    StudyError,
)
from tolstat.execution.compatibility import trials_drawn_otherwise
from tolstat.execution.continuation import plan_again, study_of
from tolstat.execution.stages import drawn_again
from tolstat.model.contract import Model
from tolstat.statistics.estimate import RANDOM_ONLY
from tolstat.statistics.reweighting.weights import LEAST_EFFECTIVE, Weights
from tolstat.store.commands import to_run_anew
from tolstat.store.fresh_run_advice import AT_RANDOM, own_run
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study import Study
from tolstat.study.study_bounds import check_lines


def what_if(
    run: Run | str | os.PathLike[str],
    deviations: Mapping[str, str | dict[str, Any]],
    *,
    limits: Mapping[str, str | dict[str, Any]] | None = None,
    model: Model | None = None,
) -> WhatIf:
    """Say what a run would have found with other deviations; nothing is simulated.

    The stored trials are weighted by the ratio of densities.

    Parameters
    ----------
    run : Run or path
        Of random trials.
    deviations : mapping of str to str or dict
        As the section [deviations] of a study has them: `{"rod_length": "+-0.6 mm"}`.
    limits : mapping, optional
        Asked anew, too; see `limited`.
    model : Model, optional
        A machine of your own, if the run is of one.

    Returns
    -------
    WhatIf
        Every number with an interval that holds for weighted trials, or why it has
        none.

    Raises
    ------
    StudyError
        If what is asked cannot be read, or the run does not cover it: why, and what
        runs it.
    """
    run = run if isinstance(run, Run) else open_run(run)
    if limits:
        run = with_limits(run, limits)
    drawn, _ = reportable(run)
    if drawn.sample.replicates:
        raise PictureError(
            f"{run.path}: what-if is {RANDOM_ONLY}: {run.sampling} trials depend on "
            f"each other; {own_run(run, AT_RANDOM, 'random')}"
        )
    study = study_of(run, model=model)
    _check_drawn(run, study)
    problems = Problems(f"{run.path}", "cannot be asked that")
    asked = _read(deviations, study, run, problems)
    problems.raise_if_any()
    found = _covered(asked, study, drawn, problems)
    changed = _kinds_changed(deviations, asked, study, run, drawn)
    if not found:
        own = run_that_tells(deviations, limits or {}, asked, study, run)
        raise StudyError("\n  ".join([problems.words, *changed, own]))
    weights = found.weights
    weighted = drawn._replace(sample=drawn.sample._replace(weights=weights))
    before, after = summaries_of(drawn), summaries_of(weighted)
    return WhatIf(
        run.title,
        run.path.name,
        run.model,
        Asked(
            {
                name: Changed(run.assumed[name].words, words, found.worth[name])
                for name, words in asked.words.items()
            },
            len(drawn.trials),
            weights.number,
            found.cover.efficiency * len(drawn.trials),
        ),
        joint_findings(weighted),
        joint_findings(drawn),
        {
            response.name: Weighed(
                **vars(after[response.name]),
                nominal=run.nominal_values[response.name],
                sentence=response.sentence,
                scale=run.scales[response.name],
                as_run=before[response.name],
            )
            for response in run.responses
        },
        (*changed, *notes_of(run, weighted.sample), *reading_of(run, weighted.sample)),
    )


def _check_drawn(run: Run, study: Study) -> None:
    """Refuse a run whose study draws other machines by now."""
    plan = plan_again(run, study, drawn_again(run, study).trials)
    if len(trials_drawn_otherwise(run, plan)):
        raise RunFileError(
            f"{run.path}: its study draws other deviations by now, because its data or "
            f"the machine are others; {to_run_anew(run)}"
        )


def _read(
    given: Mapping[str, str | dict[str, Any]],
    study: Study,
    run: Run,
    problems: Problems,
) -> Deviations:
    """Read what is asked, as lines of [deviations], with the files of the study."""
    check_lines("deviations", given, problems)
    for name, line in given.items():
        if isinstance(line, dict) and "common" in line:
            with problems.noting(f"[deviations] {name}", line):
                raise DependenceError(
                    "what hangs together stays as it was drawn; leave out common"
                )
    if not given:
        problems.add("[deviations]", None, "nothing is asked; name a contributor")
    folder = (run.study_file or run.path).parent
    contributors = study.description.contributors
    return read_deviations(given, {}, contributors, folder, problems)


def _kinds_changed(
    given: Mapping[str, str | dict[str, Any]],
    asked: Deviations,
    study: Study,
    run: Run,
    drawn: Drawn,
) -> list[str]:
    """Say where a range alone, which is normal, takes the place of another kind.

    And what keeps the kind, as far as the trials cover that.
    """
    changes = _changes(given, asked, study, run)
    if not changes:
        return []
    names = [each.name for each in study.description.contributors]
    every = {n: line for name, line in given.items() for n in expand(name, names)}

    def told(some: list[_Change]) -> bool:
        """Tell whether the trials tell what is asked, with these kinds kept."""
        kept = {member: each.keys for each in some for member in each.members}
        problems = Problems(f"{run.path}")
        with suppress(StudyError):  # so many that they are raised at once
            read = _read({**every, **kept}, study, run, problems)
            if not problems.found:
                return _covered(read, study, drawn, problems) is not None
        return False

    # kept one by one only where they are not told with all kept
    keepable = changes if told(changes) else [each for each in changes if told([each])]
    said = []
    for each in changes:
        kind = each.keys["distribution"]
        keeps = (
            f"{toml_of(each.keys)} keeps it {kind} in a run of its own; these trials "
            "do not tell that either"
        )
        if each in keepable:
            keeps = f"{each.of}={quote(toml_of(each.keys))} keeps it {kind}"
        said.append(f"{each.of} was drawn {kind}, and a range alone is normal: {keeps}")
    return said


class _Change(NamedTuple):
    """A contributor that a range alone makes normal, or all of one name alike."""

    of: str
    members: list[str]
    keys: dict[str, Any]  # of its line, with the range and the kind that it has


def _changes(
    given: Mapping[str, str | dict[str, Any]],
    asked: Deviations,
    study: Study,
    run: Run,
) -> list[_Change]:
    """List what a range alone makes normal."""
    names = [each.name for each in study.description.contributors]
    drawn, table = study.deviating.distributions, run.study.table
    lines = {
        member: line
        for name, line in (table.get("links", {}) | table.get("deviations", {})).items()
        if isinstance(line, dict) and "distribution" in line
        for member in expand(name, names)
    }
    found = []
    for name, words in given.items():
        members = expand(name, names) if isinstance(words, str) else []
        alike = all(lines.get(each) == lines.get(members[0]) for each in members)
        for member in members[:1] if alike else members:
            new, before = asked.distributions[member], drawn.get(member)
            if member not in lines or type(new) is type(before):
                continue
            own = {k: v for k, v in lines[member].items() if k in vars(before)}
            kind = lines[member]["distribution"]
            keys = {**own, "tolerance": words, "distribution": kind}
            of, some = (name, members) if alike else (member, [member])
            found.append(_Change(of, some, keys))
    return found


class _Covered(NamedTuple):
    """What the trials say of other deviations."""

    worth: dict[str, float]  # effective trials for each, of each change by itself
    cover: Overlap
    weights: Weights


def _covered(
    asked: Deviations, study: Study, drawn: Drawn, problems: Problems
) -> _Covered | None:
    """Weight the trials; None where they do not cover what is asked, which is noted."""
    worth = _worth(asked, study, problems)
    if problems.found:
        return None
    with problems.noting("all together", None):
        cover = _cover(asked.distributions, study, len(drawn.trials), worth)
        weights = Weights(_ratio(drawn, study, asked), cover.most, cover.cut)
        if weights.too_few:
            raise DistributionError(f"{weights.too_few}: {LEAST_EFFECTIVE} are needed")
        return _Covered(worth, cover, weights)
    return None


def _worth(asked: Deviations, study: Study, problems: Problems) -> dict[str, float]:
    """Check that each change by itself is covered; what each leaves of the trials."""
    found, as_drawn = {}, study.deviating
    for name, new in asked.distributions.items():
        with problems.noting(f"[deviations] {name}", asked.words[name]):
            if name not in as_drawn.distributions:
                raise DistributionError("it does not deviate in this run")
            with_it = equal_parts(name, as_drawn.dependence)
            if any(asked.distributions.get(n) != new for n in with_it):
                raise DistributionError(
                    f"all parts of its batch are equal: {', '.join(with_it)}"
                )
            try:
                found[name] = check_overlap(as_drawn.distributions[name], new)
            except DistributionError as error:
                drawn = as_drawn.words[name]
                raise DistributionError(f"{error}; drawn was {drawn}") from None
    return found


def _cover(
    new: Mapping[str, Distribution],
    study: Study,
    trials: int,
    worth: Mapping[str, float],
) -> Overlap:
    """Check that the trials are worth enough for all changes together."""
    as_drawn = study.deviating
    try:
        found = overlap_of(as_drawn.distributions, as_drawn.dependence, new, trials)
    except DistributionError as error:
        joint = dependent_groups(new, as_drawn.dependence)
        left = [name for group in joint for name in group if name not in new]
        more = f": {', '.join(left)} too" if left else ""
        raise DistributionError(f"{error}{more}") from None
    if found.efficiency * trials < LEAST_EFFECTIVE:
        least = sorted(worth, key=lambda name: worth[name])
        each = ", ".join(f"{name} alone {100 * worth[name]:.2g} %" for name in least)
        raise DistributionError(
            f"{found.efficiency * trials:.0f} effective trials would be left of "
            f"{trials}, and {LEAST_EFFECTIVE} are needed ({each})"
        )
    return found


def _ratio(drawn: Drawn, study: Study, asked: Deviations) -> Any:
    """Return the weights of the trials: float64[trial]."""
    as_drawn = study.deviating
    values = {name: drawn.values(name) for name in as_drawn.distributions}
    weighting = DensityRatio(values, as_drawn.distributions, as_drawn.dependence)
    return weighting.weights(asked.distributions)
