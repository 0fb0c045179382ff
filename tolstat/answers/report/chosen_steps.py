"""Findings about the limits of a run: what would help, and what to do next."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tolstat.answers.next_steps import (
    Step,
    StepKind,
    can_allocate,
    can_extend,
    finer_settings,
    holds,
    with_commands,
)
from tolstat.answers.remedy.remedy_finding import Evidence, RemedyFinding
from tolstat.answers.report.report_answer import (
    NOT_BY_TOLERANCES,
    Findings,
    LimitFinding,
    NoCause,
)
from tolstat.answers.report.report_warnings import (
    JumpWarning,
    ReportWarning,
    decided_by_errors,
)
from tolstat.answers.report.response_summary import ResponseSummary, by_what_decides
from tolstat.answers.run_answer import predicted_seconds
from tolstat.answers.sampled_trials import Drawn, audited_of
from tolstat.statistics.limits.yields import MET, NOT_MET, UNDECIDED, Caveat
from tolstat.statistics.sample_size import FEWEST_RANDOM, MOST_ROWS, grown, is_thinned
from tolstat.statistics.sensitivity.named_causes import LEAST
from tolstat.statistics.summary import Limited
from tolstat.store.stored_run import Run

# s: a run whose trials tell how long one takes; more of them than one waits for
LONG, MINUTE = 10.0, 60.0
MOST_RTOL = 1e-6  # the audit of a far too rough run is too rough as well

Responses = Mapping[str, ResponseSummary]
Limits = Mapping[str, LimitFinding]


def findings_of(
    drawn: Drawn, responses: Responses, warnings: Sequence[ReportWarning]
) -> Findings:
    """Return what is decided about the limits of a run of sampled trials."""
    limited = by_what_decides(responses)
    limits = {name: _limit_finding(responses[name], x) for name, x in limited.items()}
    rough = decided_by_errors(limited, warnings)
    jumps = [warning for warning in warnings if isinstance(warning, JumpWarning)]
    remedy = None
    if not rough and limits.keys().isdisjoint(jump.response for jump in jumps):
        remedy = _remedy(drawn, limits)
    steps = _steps(drawn, responses, limits, remedy, rough=rough, jumps=jumps)
    return Findings(limits, remedy, with_commands(drawn.run, steps))


def _remedy(drawn: Drawn, limits: Limits) -> RemedyFinding | None:
    """Return what meets all limits together; None where that is not known.

    Only more trials tell of limits that seem met, or missed by a few trials. And a run
    that is not complete, or a search for trials out of limit, says nothing about
    tolerances.
    """
    run = drawn.run
    out_of = {name: np.count_nonzero(run.beyond(name)) for name in limits}
    missed = any(
        limit.verdict == NOT_MET or (limit.seems_missed and out_of[name] >= LEAST)
        for name, limit in limits.items()
        if limit.verdict != MET and not limit.measured  # more parts come first
    )
    if not missed or run.aim or not run.complete:
        return None
    from tolstat.answers.remedy.find_remedy import remedy_of  # of missed limits alone

    unmet = [limit.causes for limit in limits.values() if limit.verdict != MET]
    remedy = remedy_of(drawn, unmet)
    decided = any(limit.verdict == NOT_MET for limit in limits.values())
    return remedy if decided or (remedy and remedy.steps) else None


def _limit_finding(response: ResponseSummary, limited: Limited) -> LimitFinding:
    yields, causes = limited.yields, response.causes
    finding = LimitFinding(
        yields.verdict,
        yields.reason,
        yields.needed,
        yields.fraction_out_of_limit.value > 1 - limited.limit.demanded,
        measured=yields.measured if yields.reason == Caveat.FEW_PARTS else None,
    )
    if causes is None:
        return finding
    if causes.named:
        return finding._replace(causes=tuple(cause.members for cause in causes.named))
    by_tolerances = causes.reason not in NOT_BY_TOLERANCES
    largest = response.largest_share if by_tolerances else None
    return finding._replace(
        no_cause=causes.reason or NoCause.NOT_SIGNIFICANT,
        trials_that_tell=0 if yields.verdict == MET else causes.needed,
        largest_contribution=largest[0] if largest else "",
    )


def _steps(
    drawn: Drawn,
    responses: Responses,
    limits: Limits,
    remedy: RemedyFinding | None,
    *,
    rough: Sequence[str],
    jumps: Sequence[JumpWarning],
) -> Iterator[Step]:
    """Yield the next steps, the first one first."""
    run = drawn.run
    if not run.complete:
        kind = StepKind.FINISH if run.ended == run.trials else StepKind.RESUME
        yield Step(kind)
        return
    failing = [n for n in rough if limits[n].reason == Caveat.FAILED_AGAIN]
    if failing:
        yield _failed_again(run, failing)
    if finer := finer_run(run, [name for name in rough if name not in failing]):
        yield finer
    if rough:  # the other numbers are of the rough run, too
        return
    for jump in sorted(jumps, key=lambda jump: not jump.clusters.turn):
        turn = jump.clusters.turn
        kind = StepKind.MEND_FORMULA if turn else StepKind.CHECK_FORMULA
        yield Step(kind, (jump.response,))
    if run.aim:
        return  # a search for trials out of limit says nothing about tolerances
    for step in (
        _measured(limits),
        _changed(limits, remedy),
        _more_trials(drawn, responses, limits, remedy),
        _searched(run, limits),
        _allocated(run, limits),
    ):
        if step:
            yield step


def _measured(limits: Limits) -> Step | None:
    """Return the step that measures more parts; None where these are enough."""
    shares = {n: limit.measured for n, limit in limits.items() if limit.measured}
    if not shares:
        return None
    most = max(shares.values(), key=lambda share: share.needed or math.inf)
    return Step(StepKind.MEASURE_PARTS, tuple(shares), measured=most)


def _failed_again(run: Run, responses: Sequence[str]) -> Step:
    """Return the step that shows a trial that failed when evaluated again."""
    trials, (name, *_) = run.audited.trials if run.audited else (), responses
    precise = run.audited.responses[name] if run.audited else ()
    stored = np.isnan(run.column(name)[trials])
    trial = int(trials[np.flatnonzero(~stored & np.isnan(precise))[0]])
    return Step(StepKind.SEE_FAILED, tuple(responses), trial=trial)


def finer_run(run: Run, responses: Sequence[str]) -> Step | None:
    """Return the settings with which a new run decides limits; None without limits.

    Of limits that integration errors leave undecided, unless no steps are short enough.
    """
    checked = {n: x for n in responses if (x := audited_of(run, n)) and not x.grows}
    if not checked or (audited := run.audited) is None:
        return None
    unsettled = any(x.unsettled.any() or x.jumped_over for x in checked.values())
    settings = dict(audited.settings)
    if audited.third and unsettled:  # rtol alone finds no event that steps miss
        longest = "max_step" if "max_step" in settings else "rtol"
        settings[longest] = audited.third.settings[longest]
    if "rtol" in settings:
        settings["rtol"] = min(settings["rtol"], MOST_RTOL)
    return Step(
        StepKind.FINER_RUN, tuple(checked), change=finer_settings(run, settings)
    )


def _changed(limits: Limits, remedy: RemedyFinding | None) -> Step | None:
    """Return the step that changes entries, or says why none helps."""
    if remedy is None:
        return None
    return Step(
        StepKind.REMEDY,
        tuple(name for name, limit in limits.items() if limit.verdict != MET),
        parts=tuple(name for x in remedy.changes for name in x.members),
        change=remedy.change,
        prediction=remedy.in_one if remedy.steps else None,
    )


def _more_trials(
    drawn: Drawn, responses: Responses, limits: Limits, remedy: RemedyFinding | None
) -> Step | None:
    """Return the step that adds trials; None where no more would tell.

    Until a verdict falls, and until causes can be named of a limit that more trials
    miss than it permits. A limit that seems missed is no longer decided where a proved
    remedy meets it. How many thinned trials decide may not be known: 0.
    """
    run = drawn.run
    mended = remedy is not None and remedy.met and remedy.evidence is Evidence.PROVED
    deciding = {
        name: limit.trials_that_decide
        for name, limit in limits.items()
        if not (mended and limit.seems_missed)
        if holds(run, limit.trials_that_decide)
    }
    undecided = tuple(
        name
        for name, trials in deciding.items()
        for limit in [limits[name]]
        if trials or (run.thinned and limit.verdict == UNDECIDED and not limit.reason)
    )
    telling = {
        name: causes.needed
        for name, limit in limits.items()
        if limit.verdict != MET and limit.seems_missed and not mended
        if (causes := responses[name].causes)
    }
    needed = max(deciding.values(), default=0)
    # the response that needs the fewest; empty if none needs any
    told = min(filter(telling.get, telling), key=telling.__getitem__, default="")
    if told and not (telling[told] > needed and can_extend(run, telling[told])):
        told = ""
    if not undecided and not told:
        return None
    needed = telling[told] if told else needed
    kind, evaluated, slow = StepKind.ADD_TRIALS, 0, False
    if run.sampling == "random" and not told:
        kind, numbers = StepKind.DECIDE, {name: deciding[name] for name in undecided}
        evaluated, slow = _deciding(drawn, numbers)
    return Step(
        kind, undecided, (told,) if told else (), trials=needed, evaluated=evaluated,
        slow=slow,
    )  # fmt: skip


def _deciding(drawn: Drawn, numbers: Mapping[str, int]) -> tuple[int, bool]:
    """Return how many trials decide limits if few do; and if they have to be slow.

    `numbers` are those of plain trials that decide each limit. All are evaluated if
    these are quick, or no surface tells which few would do: 0.
    """
    run, first = drawn.run, max(drawn.run.ended, FEWEST_RANDOM)
    trials = max(numbers.values())
    few = is_thinned(
        trials - first,
        isolated=run.isolation is not None,
        integrates=run.steps is not None,
    )
    is_slow = run.times["seconds"] > LONG and predicted_seconds(run, trials) > MINUTE
    if run.thinned or trials <= first or not (few or is_slow):
        return 0, False
    from tolstat.statistics.deciding.chances import evaluated_part  # seldom

    deviations = np.stack([drawn.values(x.name) for x in run.contributors], axis=1)
    done = drawn.sample.done
    parts = {
        name: evaluated_part(deviations, drawn.values(name), done, run.limits[name])
        for name in numbers
    }
    if min(parts.values()) == 1:
        return 0, False
    more = max(part * max(numbers[name] - first, 0) for name, part in parts.items())
    return grown(first + more), not few


def _searched(run: Run, limits: Limits) -> Step | None:
    """Return the step that searches rare trials; None where a plain run decides."""
    names = tuple(
        name
        for name, limit in limits.items()
        if limit.verdict == UNDECIDED and not limit.reason
        if not 0 < limit.trials_that_decide <= MOST_ROWS
    )
    if not names or run.thinned or run.listed or run.sampling != "random":
        return None
    return Step(StepKind.SEARCH_RARE, names)


def _allocated(run: Run, limits: Limits) -> Step | None:
    """Return the step that searches the cheapest tolerances, of a study with costs."""
    unmet = {n: limit for n, limit in limits.items() if limit.verdict != MET}
    if not unmet or any(limit.reason for limit in limits.values()):
        return None
    return Step(StepKind.ALLOCATE, tuple(unmet)) if can_allocate(run) else None
