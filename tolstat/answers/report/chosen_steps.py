"""Findings about the limits of a run: what would help, and what to do next."""

import math
from collections.abc import Iterator, Mapping, Sequence

from tolstat.answers.halved_entries import common_tolerance, halved_entries, to_narrow
from tolstat.answers.next_steps import (
    to_allocate,
    to_extend,
    to_halve,
    to_resume,
    to_run_again,
    to_shift,
    typed_setting,
)
from tolstat.answers.report.report_answer import (
    NOT_BY_TOLERANCES,
    Evidence,
    Findings,
    Halving,
    LimitFinding,
    NoCause,
    Step,
    StepKind,
)
from tolstat.answers.report.report_warnings import JumpWarning, ReportWarning
from tolstat.answers.report.response_summary import ResponseSummary, by_what_decides
from tolstat.answers.sampled_trials import audited_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import (
    INTEGRATION_ERROR,
    MET,
    NOT_MET,
    Caveat,
)
from tolstat.statistics.summary import Limited
from tolstat.store.stored_run import Run

MOST_NAMED = 4  # parts that a change names
MOST_RTOL = 1e-6  # the audit of a far too rough run is too rough as well

Responses = Mapping[str, ResponseSummary]
Limits = Mapping[str, LimitFinding]


def findings_of(
    run: Run, responses: Responses, warnings: Sequence[ReportWarning]
) -> Findings:
    """Return what is decided about the limits of a run of sampled trials."""
    limits = {
        name: _limit_finding(run, responses[name], limited)
        for name, limited in by_what_decides(responses).items()
    }
    centring = [centring_of(run, name, responses[name]) for name in limits]
    known = sorted(filter(None, centring), key=lambda step: not step.parts)
    by_response = {step.responses[0]: step for step in known}
    steps = _steps(run, responses, limits, by_response, warnings)
    return Findings(limits, by_response, tuple(steps))


def _limit_finding(
    run: Run, response: ResponseSummary, limited: Limited
) -> LimitFinding:
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
        return finding._replace(
            causes=tuple(cause.members for cause in causes.named),
            halving=halving_of(run, response, limited),
        )
    by_tolerances = causes.reason not in NOT_BY_TOLERANCES
    largest = response.largest_share if by_tolerances else None
    return finding._replace(
        no_cause=causes.reason or NoCause.NOT_SIGNIFICANT,
        trials_that_tell=0 if yields.verdict == MET else causes.needed,
        largest_contribution=largest[0] if largest else "",
    )


def halving_of(run: Run, response: ResponseSummary, limited: Limited) -> Halving | None:
    """Return the effect of half the tolerances of the main cause of a limit.

    None where it is met, or no cause is named.
    """
    main = response.causes.main if response.causes else None
    if main is None or limited.yields.verdict == MET:
        return None
    entries = halved_entries(run, main.members)
    common = common_tolerance(run, entries) if len(entries) <= MOST_NAMED else ""
    before = limited.yields.fraction_out_of_limit
    return Halving(
        main.words, main.members, entries, common,
        before, main.halved, differ(main.halved, before),
        main.halved.lower > 1 - limited.limit.demanded,
    )  # fmt: skip


def differ(first: Estimate, second: Estimate) -> bool:
    """Tell whether two fractions differ significantly.

    They do if their intervals do not overlap. Each end errs in 2.5 % of all runs, so
    one of the two facing ends errs in at most 5 %. The trials are the same: an interval
    of the difference would be narrower, but its coverage was not measured.
    """
    return first.upper < second.lower or second.upper < first.lower


def centring_of(run: Run, name: str, response: ResponseSummary) -> Step | None:
    """Return the shift that centres a response; None if it is not off centre.

    The first one with commands, else the least over its tolerance.
    """
    off, limited = response.off_centre, response.limited
    if off is None or limited is None:
        return None
    needed, before = off.shifted.needed, limited.yields.fraction_out_of_limit
    options = [
        (shift, to_shift(run, name, shift.members, shift.shift, needed))
        for shift in off.shifts
    ]
    step = Step(
        StepKind.CENTRE, (name,), before=before, trials=needed,
        after=off.shifted.fraction_out_of_limit, evidence=Evidence.PREDICTED,
    )  # fmt: skip
    for shift, commands in (*(each for each in options if each[1]), *options[:1]):
        return step._replace(
            parts=shift.members, shift=shift.shift, commands=tuple(commands)
        )
    return step


def _steps(
    run: Run,
    responses: Responses,
    limits: Limits,
    centring: Mapping[str, Step],
    warnings: Sequence[ReportWarning],
) -> Iterator[Step]:
    """Yield the next steps, the first one first."""
    if not run.complete:
        kind = StepKind.FINISH if run.ended == run.trials else StepKind.RESUME
        yield Step(kind, commands=(to_resume(run.path, run.machine),))
        return
    rough = [n for n, limit in limits.items() if limit.reason == INTEGRATION_ERROR]
    if finer := finer_run(run, rough):
        yield finer  # the other numbers are of the rough run, too
        return
    jumps = [each for each in warnings if isinstance(each, JumpWarning)]
    for jump in sorted(jumps, key=lambda jump: not jump.clusters.turn):
        turn = jump.clusters.turn
        kind = StepKind.MEND_FORMULA if turn else StepKind.CHECK_FORMULA
        yield Step(kind, (jump.response,))
    if run.aim:
        return  # a search for trials out of limit says nothing about tolerances
    yield from (step for step in centring.values() if step.parts)
    for step in (
        _measured(limits),
        _halved(run, limits),
        _more_trials(run, responses, limits),
        _allocated(run, responses, limits),
    ):
        if step:
            yield step


def _measured(limits: Limits) -> Step | None:
    """Return the step that measures more parts; None where these are enough."""
    names = tuple(name for name, limit in limits.items() if limit.measured)
    return Step(StepKind.MEASURE_PARTS, names) if names else None


def finer_run(run: Run, responses: Sequence[str]) -> Step | None:
    """Return the settings with which a new run decides limits; None without limits.

    Of limits that integration errors leave undecided.
    """
    if not responses or (audited := run.audited) is None:
        return None
    checked = filter(None, (audited_of(run, name) for name in responses))
    unsettled = any(response.unsettled.any() for response in checked)
    settings = dict(audited.settings)
    if audited.third and unsettled:  # rtol alone finds no event that steps miss
        longest = "max_step" if "max_step" in settings else "rtol"
        settings[longest] = audited.third.settings[longest]
    if "rtol" in settings:
        settings["rtol"] = min(settings["rtol"], MOST_RTOL)
    again = to_run_again(run)
    return Step(
        StepKind.FINER_RUN,
        tuple(responses),
        settings={n: typed_setting(run, n, value) for n, value in settings.items()},
        commands=(again,) if again else (),
    )


def _halved(run: Run, limits: Limits) -> Step | None:
    """Return the step that halves tolerances of a main cause; None without a gain.

    First what the stored trials show to gain, then what only a fresh run tells.
    """
    halvings = {
        name: limit.halving
        for name, limit in limits.items()
        if limit.halving and not limit.reason  # else the numbers are wrong
    }
    for name, halving in halvings.items():
        gains = halving.after.value < halving.before.value
        if gains and (halving.significant or limits[name].seems_missed):
            return _halving_step(run, name, halving, Evidence.PREDICTED)
    for name, halving in halvings.items():
        if math.isnan(halving.after.value):
            return _halving_step(run, name, halving, Evidence.UNKNOWN)
    return None


def _halving_step(run: Run, name: str, halving: Halving, evidence: Evidence) -> Step:
    commands = to_halve(run, halving.parts)
    kind = StepKind.HALVE if halving.significant else StepKind.TEST_HALF
    step = Step(
        kind, (name,), parts=halving.parts, entries=halving.entries,
        before=halving.before, after=halving.after, evidence=evidence,
        commands=tuple(commands),
    )  # fmt: skip
    if commands or evidence is Evidence.PREDICTED:
        return step
    return step._replace(kind=StepKind.NOT_HALVED, reason=str(halving.after.reason))


def _more_trials(run: Run, responses: Responses, limits: Limits) -> Step | None:
    """Return the step that adds trials; None where no more would tell.

    Until a verdict falls, and until causes can be named of a limit that more trials
    miss than it permits.
    """
    deciding = {n: x.trials_that_decide for n, x in limits.items()}
    telling = {
        name: causes.needed
        for name, limit in limits.items()
        if limit.verdict != MET and limit.seems_missed
        if (causes := responses[name].causes)
    }
    decided, told = _fewest(deciding), _fewest(telling)
    needed = deciding[decided] if decided else 0
    if told and not (telling[told] > needed and to_extend(run, telling[told])):
        told = ""
    if not decided and not told:
        return None
    needed = telling[told] if told else needed
    command = to_extend(run, needed)
    return Step(
        StepKind.ADD_TRIALS,
        (decided,) if decided else (),
        (told,) if told else (),
        trials=needed,
        commands=(command,) if command else (),
    )


def _fewest(trials: Mapping[str, int]) -> str:
    """Return the response that needs the fewest trials; empty if none needs any."""
    needing = [name for name in trials if trials[name]]
    return min(needing, key=lambda name: trials[name], default="")


def _allocated(run: Run, responses: Responses, limits: Limits) -> Step | None:
    """Return the step that searches the cheapest tolerances; None where all is met.

    Without costs in the study, only where halving those of the causes is too little, or
    enough trials are out of limit and none of their causes is named.
    """
    unmet = {n: limit for n, limit in limits.items() if limit.verdict != MET}
    if not unmet or any(limit.reason for limit in limits.values()):
        return None
    parts = dict[str, None]()
    for name, limit in unmet.items():
        response = responses[name]
        causes, halving = response.causes, limit.halving
        if not causes or causes.reason in NOT_BY_TOLERANCES:
            continue
        if halving is None:
            if limit.verdict == NOT_MET and not causes.needed:
                parts |= dict.fromkeys(response.most_of_variance)
        elif halving.still_missed or halving.after.value >= halving.before.value:
            parts |= dict.fromkeys(n for cause in limit.causes for n in cause)
    # a phase and measured parts have no tolerance
    priced = [name for name in parts if to_narrow(run, [name])]
    if not (commands := tuple(to_allocate(run, priced))):
        return None
    return Step(
        StepKind.ALLOCATE,
        tuple(unmet),
        parts=tuple(priced) if len(commands) > 1 else (),
        commands=commands,
    )
