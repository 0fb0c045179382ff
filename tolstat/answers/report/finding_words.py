"""Findings in words: warnings, what is off centre, what to do next."""

import math
from collections.abc import Iterable
from itertools import groupby

from tolstat.answers.cells import ppm
from tolstat.answers.measured_words import few_parts, measured_alone, to_measure
from tolstat.answers.next_steps import as_typed
from tolstat.answers.report.chosen_steps import MOST_NAMED
from tolstat.answers.report.off_centre import OffCentre, Outside
from tolstat.answers.report.report_answer import (
    Evidence,
    Findings,
    Halving,
    RunSummary,
    Step,
    StepKind,
)
from tolstat.answers.report.report_warnings import (
    AllPartsWarning,
    IdleContributors,
    JumpWarning,
    NumbersWarning,
    PartsWarning,
    ReportWarning,
    StudyWarning,
    UnchangedResponse,
    VerdictWarning,
)
from tolstat.answers.report.response_summary import ResponseSummary
from tolstat.deviations.names import general
from tolstat.document import blocks
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import Movement
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

MOST_OFF_CENTRE = 2  # of which a first page says what helps
NOT_BEYOND = " Trials do not reach beyond the tolerances: slopes may not hold there."
SHORT = " (max_step below the shortest event, or a mark where one begins and ends)"
TURN_WORDS = {0.5: "half a", 1.0: "a whole"}
# an angle never jumps by a turn, while a machine with play or a stop may well jump
MEND_TURN = ", so no tolerance explains it. Mend the formula of the response"
MEND_STEP = ". If the machine does not jump so, mend the formula of the response"
STILL_MISSED = ", still not met"
# sentences that name all responses with such a step
NAMING = {
    StepKind.MEND_FORMULA: "Mend the formula of {}, as said above.",
    StepKind.CHECK_FORMULA: "Mend the formula of {} if the machine does not jump as "
    "said above.",
    StepKind.CENTRE: "Centre {} first, as said above.",
}


def what_next(steps: tuple[Parts, ...]) -> blocks.Section:
    """Return the section of next steps, the first one first."""
    bullets = blocks.Bullets(steps, numbered=len(steps) > 1)
    return blocks.section("What to do next", bullets, level=3)


def next_steps(summary: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next; steps of one kind that say the same stand together."""
    run, findings, sentences = summary.stored_run, summary.findings, list[Parts]()
    for kind, group in groupby(findings.steps, key=lambda step: step.kind):
        if sentence := NAMING.get(kind):
            names = [Name(name) for step in group for name in step.responses]
            sentences.append(say(sentence, listed(names)))
        else:
            sentences += [step_words(run, step, findings) for step in group]
    return tuple(sentences)


def step_words(run: Run, step: Step, findings: Findings) -> Parts:
    """Say what to do; of a change that `findings` know also its effect."""
    typed = [Typed(command) for command in step.commands]
    match step.kind:
        case StepKind.RESUME:
            return say("Run the trials that are missing: {}.", *typed)
        case StepKind.FINISH:
            sentence = "Finish the run, whose audit or diagnostics are missing: {}."
            return say(sentence, *typed)
        case StepKind.FINER_RUN:
            return _finer_run(run, step)
        case StepKind.MEASURE_PARTS:
            return _measure(step, findings)
        case StepKind.ADD_TRIALS:
            return _add_trials(step)
        case StepKind.ALLOCATE if len(typed) == 1:
            return say("Find the cheapest tolerances that meet all limits: {}.", *typed)
        case StepKind.ALLOCATE:
            parts = listed([*map(Name, step.parts)])
            return say("Find the widest tolerances of {} that meet all limits. Write "
                       "prices of 1 over the tolerance: {} Search: {}",
                       parts, *typed)  # fmt: skip
        case StepKind.SEE_WORST:
            return say("See the worst one in detail: {}.", *typed)
        case StepKind.DRAW_RESPONSE:
            (other,) = map(Name, step.responses)
            return say("Draw another response, such as {}: {}.", other, *typed)
        case StepKind.WRITE_TABLE:
            return say("Write all trials as a table: {}.", *typed)
    halving = findings.limits[step.responses[0]].halving
    assert halving  # the other kinds halve the tolerances of a cause
    return _halve(step, halving)


def _finer_run(run: Run, step: Step) -> Parts:
    lines = [Word(f"{name} = {value}") for name, value in step.settings.items()]
    again = [Typed(command) for command in step.commands]
    study = as_typed(run.study_file) if again and run.study_file else "the study"
    return say(
        "Decide {}, whose integration errors are too large: write {} into [settings] "
        "of {}{}, then run it again{}.",
        listed([*map(Name, step.responses)]), listed(lines), f"{study}",
        SHORT if "max_step" in step.settings else None,
        text(": ", again) if again else None,
    )  # fmt: skip


def _measure(step: Step, findings: Findings) -> Parts:
    shares = [findings.limits[name].measured for name in step.responses]
    most = max(filter(None, shares), key=lambda share: share.needed or math.inf)
    names = listed([*map(Name, step.responses)])
    action = text(to_measure(most))
    return say("To decide {}, {}: more trials tell little.", names, action)


def _add_trials(step: Step) -> Parts:
    purposes = [say("decide {}", Name(name)) for name in step.responses]
    purposes += [say("find the causes of {}", Name(name)) for name in step.causes_of]
    trials = counted(step.trials, "trial")
    in_all = [text(" in all: ", Typed(command)) for command in step.commands]
    return say("Add trials to {}: about {}{}.", listed(purposes), trials,
               in_all or ", in a new run of the study")  # fmt: skip


def _halve(step: Step, halving: Halving) -> Parts:
    (name,), cause = step.responses, cause_words(halving)
    if step.kind is StepKind.NOT_HALVED:
        return say(f"{{}} cannot be halved: {step.reason}.", cause)
    effect = say("the effect on {} is not estimable", Name(name))
    if step.evidence is Evidence.PREDICTED:
        falls = "falls" if halving.significant else "may fall"
        missed = STILL_MISSED if halving.still_missed else None
        effect = say(f"{{}} {falls} from {{}} to {{}}{{}}", Name(name),
                     ppm(step.before), ppm(step.after), missed)  # fmt: skip
    halve = "Halve" if step.kind is StepKind.HALVE else "Test half"
    tolerances = "tolerance" if len(step.parts) == 1 else "tolerances"
    fresh = [Typed(command) for command in step.commands]
    return say(
        f"{halve} the {tolerances} of {{}}: {{}}{{}}", cause, effect,
        say(". Check it with a fresh run: {} Run it: {}", *fresh) if fresh else ".",
    )  # fmt: skip


def cause_words(halving: Halving) -> Parts:
    """Name the parts of the main cause: each of a few, in one word if many."""
    if len(halving.parts) > MOST_NAMED:
        return text(halving.words)
    return listed([*map(Name, halving.parts)])


def off_centre_words(summary: RunSummary) -> tuple[Parts, ...]:
    """Say which responses are off centre; of the first ones also what helps."""
    first, others = list[Parts](), list[Parts]()
    for name, step in summary.findings.centring.items():
        response = summary.responses[name]
        if len(first) < MOST_OFF_CENTRE:
            first.append(centring_words(summary.stored_run, response, step))
        elif response.off_centre:
            where = _distance(response, response.off_centre)
            others.append(text(Name(name), ": ", where))
    return (*first, *([say("Also off centre: {}.", listed(others))] if others else []))


def _distance(response: ResponseSummary, off: OffCentre) -> Parts:
    """Say where the nominal value or the mean lies, against an end of the limit."""
    mean, scale = response.mean, response.scale
    if off.what is Outside.NOTHING and (limited := response.limited):
        lower, upper = limited.limit.permitted
        if limited.limit.ends == 2:
            return say("mean lies {} off the middle", Number(abs(off.shift), scale))
        if mean.lower <= upper <= mean.upper or mean.lower <= lower <= mean.upper:
            return say("mean lies on the end of the limit")
        if (inside := min(upper - off.value, off.value - lower)) > 0:
            return say("mean lies {} inside the limit", Number(inside, scale))
    where = f"{'above' if off.shift < 0 else 'below'} the limit"
    what = off.what or Outside.MEAN
    return say(f"{what} lies {{}} {where}", Number(off.outside, scale))


def centring_words(run: Run, response: ResponseSummary, step: Step | None) -> Parts:
    """Say how far a response is off centre, and what helps; empty if it is not."""
    off, limited = response.off_centre, response.limited
    if step is None or off is None or limited is None:
        return ()
    (pp, ppk), (name,) = off.performance, step.responses
    value: Estimate | float = response.mean
    if off.what is Outside.NOMINAL:
        value = off.value
    elif off.what is Outside.MEDIAN:
        value = response.quantiles[0.5]
    options = []
    for by in off.shifts:
        part, *others = by.members
        subject = text("each ", Name(general(part))) if others else Name(part)
        options.append(say("{} by {}", subject, Number(by.shift, run.scales[part])))
    return text(
        Name(name), ": the ", _distance(response, off), ", at ",
        Number(value, response.scale), ". ", off.tolerances or None, off.reason or None,
        say("Pp {}, ", Number(pp)) if pp.value == pp.value else None,
        "Ppk ", Number(ppk), ": the spread is fine, the centre is not. "
        if pp.value >= limited.demanded_ppk else ". ",
        say("Shifted by {}, the trials have {} out of limit. Change the nominal value "
            "of {}.", Number(off.shift, response.scale), ppm(step.after),
            listed(options, "or")) if options
        else "No nominal value of a contributor is known to centre it.",
        NOT_BEYOND if off.shifts and off.shifts[0].relative > 1 else None,
        say(" A fresh run shows the effect. Write its study: {} Run it: {}",
            *map(Typed, step.commands)) if step.commands else None,
    )  # fmt: skip


def in_words(warnings: Iterable[ReportWarning]) -> blocks.Bullets:
    """Return warnings as a list, in front of all else."""
    return blocks.Bullets(tuple(text("Warning: ", s) for s in sentences(warnings)))


def sentences(warnings: Iterable[ReportWarning]) -> tuple[Parts, ...]:
    """Return warnings as sentences."""
    return tuple(map(_sentence, warnings))


def _sentence(warning: ReportWarning) -> Parts:
    match warning:
        case StudyWarning(sentence):
            return text(sentence)
        case IdleContributors(names):
            change, s = "its tolerance changes", ""
            if len(names) > 1:
                change, s = "their tolerances change", "s"
            return say(
                f"No response depends on {{}}: {change} nothing. Check the "
                f"name{s} and the model.",
                listed([*map(Name, names)]),
            )
        case UnchangedResponse(name, value, scale):
            return say(
                "No deviation changes {}: all trials have {}, and sigma is 0.",
                Name(name), Number(value, scale),
            )  # fmt: skip
        case JumpWarning():
            return _jump(warning)
        case VerdictWarning():
            return _verdict(warning)
        case NumbersWarning():
            return _numbers(warning)
        case PartsWarning(name, share):
            return few_parts(name, share)
        case AllPartsWarning(entries):
            return measured_alone(entries)


def _jump(warning: JumpWarning) -> Parts:
    clusters, scale = warning.clusters, warning.scale
    turn = clusters.turn
    step = f" {TURN_WORDS[turn]} turn," if turn else ""
    mend = MEND_TURN if turn else MEND_STEP
    return say(
        f"{{}} jumps by{step} {{}}: {{}} lie at {{}} or below, {{}} at {{}} or above. "
        f"Parts that are nearly equal lie on both sides{mend}, then run the study "
        "again.",
        Name(warning.response), Number(clusters.step, scale),
        counted(clusters.below, "trial"), Number(clusters.lower, scale),
        Number(clusters.above), Number(clusters.upper, scale),
    )  # fmt: skip


def _verdict(warning: VerdictWarning) -> Parts:
    errors = movement_words(warning.movement, warning.scale)
    return say("{}: undecided (integration error: {})", Name(warning.response), errors)


def movement_words(movement: Movement, scale: Scale) -> Parts:
    """Say how many trials moved when they were evaluated again, and how far."""
    exact = scale._replace(least=0.0)
    largest = Number(movement.largest, exact)
    errors = say("errors of up to {} may change the verdict", largest)
    if movement.moved:
        moved = f"{movement.moved} of {movement.trials} trials evaluated again moved"
        errors = text(moved, ", by up to ", largest)
    third = (
        f"; evaluated a third time, {movement.moved_third} of {movement.third} moved"
    )
    return text(errors, third if movement.moved_third else None)


def _numbers(warning: NumbersWarning) -> Parts:
    exact = warning.scale._replace(least=0.0)
    (name, wrong), *others = warning.numbers.items()
    more = f", and {len(others)} more" if others else None
    return say(f"{{}}: {name} {{}}, integration error {{}}{{}}",
               Name(warning.response), Number(wrong.number, exact),
               Number(wrong.error, exact), more)  # fmt: skip
