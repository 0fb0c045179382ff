"""Findings in words: warnings, and what to do next."""

from collections.abc import Iterable
from itertools import groupby

from tolstat.answers.next_steps import Step, StepKind, as_typed
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.report.report_warnings import (
    AllPartsWarning,
    ErrorsWarning,
    FarLimit,
    GrowthWarning,
    IdleContributors,
    JumpWarning,
    NumbersWarning,
    PartsWarning,
    ReportWarning,
    StepsWarning,
    StudyWarning,
    UnchangedResponse,
    UnusualParts,
    VerdictWarning,
)
from tolstat.answers.run_answer import predicted_time
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.integration_error import Movement
from tolstat.statistics.limits.yields import Caveat
from tolstat.statistics.sample_size import MOST_ROWS
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

MOST_ERRORS = 3  # responses whose integration errors are named
SHORT = " (max_step below the shortest event, or a mark where one begins and ends)"
TURN_WORDS = {0.5: "half a", 1.0: "a whole"}
# an angle never jumps by a turn, while a machine with play or a stop may well jump
MEND_TURN = ", so no tolerance explains it. Mend the formula of the response"
MEND_STEP = ". If the machine does not jump so, mend the formula of the response"
GROWTH = (
    "{}: at least twice as large with each evaluation at shorter steps. It counts "
    "steps or does not converge. Judge another response."
)
SEARCH = (
    f"To decide {{}} takes more than {MOST_ROWS} trials. A search for rare ones takes "
    f"fewer, if it misses no kind of failure: write {{}} and trials = {{}} into "
    "the study, and run it again. Or widen the limit, or demand less."
)
PLAIN = {
    StepKind.RESUME: "Run the trials that are missing: {}.",
    StepKind.FINISH: "Finish the run, whose audit or diagnostics are missing: {}.",
    StepKind.ALLOCATE: "Find the cheapest tolerances that meet all limits: {}.",
    StepKind.SEE_WORST: "See the worst one in detail: {}.",
    StepKind.WRITE_TABLE: "Write all trials as a table: {}.",
}
NAMING = {  # responses
    StepKind.MEND_FORMULA: "Mend the formula of {}, as said above.",
    StepKind.CHECK_FORMULA: "Mend the formula of {} if the machine does not jump as "
    "said above.",
    StepKind.SEE_FAILED: "Decide {}, whose trials fail when evaluated again: see one "
    "of them: {}.",
    StepKind.DRAW_RESPONSE: "Draw another response, such as {}: {}.",
}


def what_next(steps: tuple[Parts, ...]) -> blocks.Section:
    """Return the section of next steps, the first one first."""
    bullets = blocks.Bullets(steps, numbered=len(steps) > 1)
    return blocks.section("What to do next", bullets)


def next_steps(summary: RunSummary) -> tuple[Parts, ...]:
    """Say what to do next; steps of one kind that say the same stand together."""
    run, findings, sentences = summary.stored_run, summary.findings, list[Parts]()
    for _, group in groupby(findings.steps, key=lambda step: step.kind):
        step, *others = group
        names = (name for other in others for name in other.responses)
        if step.kind is StepKind.REMEDY and findings.remedy:
            from tolstat.answers.remedy.remedy_words import remedy_words  # seldom used

            sentences += remedy_words(run, findings.remedy)
        else:
            together = step._replace(responses=(*step.responses, *names))
            sentences.append(step_words(run, together))
    return tuple(sentences)


def step_words(run: Run, step: Step) -> Parts:
    """Say what to do."""
    names = listed([*map(Name, step.responses)])
    match step.kind:
        case StepKind.RESUME if run.deciding:
            return say("Go on until every limit is decided: {}.", *step.commands)
        case StepKind.FINER_RUN:
            return _finer_run(run, step)
        case StepKind.MEASURE_PARTS:
            from tolstat.answers.measured_words import to_measure  # seldom used

            assert step.measured is not None
            action = to_measure(step.measured)
            return say("To decide {}, {}: more trials tell little.", names, action)
        case StepKind.ADD_TRIALS | StepKind.DECIDE:
            return _add_trials(run, step)
        case StepKind.SEARCH_RARE:
            from tolstat.deviations.rare import ENOUGH  # seldom used

            sampling = Word(f'sampling = {{ rare = "{step.responses[0]}" }}')
            return say(SEARCH, names, sampling, str(ENOUGH))
        case kind if kind in NAMING:
            return say(NAMING[kind], names, *step.commands)
    return say(PLAIN[step.kind], *step.commands)


NEW_RUN = ", in a new run of the study"
MORE_ROWS = " in all, as more rows of the file"


def _finer_run(run: Run, step: Step) -> Parts:
    lines = [Word(f"{name} = {value}") for name, value in step.settings.items()]
    again = step.commands
    study = as_typed(run.study_file) if again and run.study_file else "the study"
    return say(
        "Decide {}, whose integration errors are too large: write {} into [settings] "
        "of {}{}, then run it again{}.",
        listed([*map(Name, step.responses)]), listed(lines), f"{study}",
        SHORT if "max_step" in step.settings and not run.isolation else None,
        text(": ", again) if again else None,
    )  # fmt: skip


def _add_trials(run: Run, step: Step) -> Parts:
    names = listed([*map(Name, step.responses)])
    purposes = [text("decide ", names)] if names else []
    purposes += [say("find the causes of {}", Name(name)) for name in step.causes_of]
    if not step.trials:  # thinned ones: how many is not known
        typed = listed(step.commands)
        return say("Add trials to {}: {}.", listed(purposes), typed)
    trials = counted(step.trials, "trial")
    few = ", of which {} are evaluated" if step.evaluated else ""
    time = predicted_time(run, step.evaluated or step.trials)
    numbers = [Number(step.evaluated)] if step.evaluated else []
    in_all = [
        say(f" in all{few} ({time}): {{}}", *numbers, command)
        for command in step.commands
    ]
    return say("Add trials to {}: about {}{}.", listed(purposes), trials,
               in_all or (MORE_ROWS if run.listed else NEW_RUN))  # fmt: skip


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
        case FarLimit(name, end, smallest, largest, scale):
            values = (Number(x, scale) for x in (end, smallest, largest))
            return say(
                "{} has a limit of {}, and trials from {} to {}. Check the unit of the "
                "limit.",
                Name(name), *values,
            )  # fmt: skip
        case JumpWarning():
            return _jump(warning)
        case VerdictWarning():
            return _verdict(warning)
        case NumbersWarning():
            return _numbers(warning)
        case PartsWarning() | AllPartsWarning():
            from tolstat.answers.measured_words import warning_words  # seldom used

            return warning_words(warning)
        case UnusualParts(entry, finding, scale):
            from tolstat.answers.parts.parts_words import finding_words  # seldom used

            unusual = finding_words(finding, scale)
            return say("Measured parts of {}. {}", Name(entry), unusual)
        case GrowthWarning(names):
            return say(GROWTH, listed([*map(Name, names)]))
        case ErrorsWarning():
            return _errors(warning)
        case StepsWarning(residual):
            return text(residual.words)


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
    movement = warning.movement
    why = text(f"{warning.reason}: ", movement_words(movement, warning.scale))
    if warning.reason == Caveat.FAILED_AGAIN:
        trials = counted(movement.trials + movement.failed_again, "trial")
        why = say(f"{movement.failed_again} of {{}} evaluated again failed", trials)
    return say("{}: undecided ({})", Name(warning.response), why)


def movement_words(movement: Movement, scale: Scale) -> Parts:
    """Say how many trials moved when they were evaluated again, and how far."""
    exact = scale._replace(least=0.0)
    largest = Number(movement.largest, exact)
    errors = say("errors of up to {} may change the verdict", largest)
    if movement.moved:
        moved = f"{movement.moved} of {movement.trials} trials evaluated again moved"
        errors = text(moved, ", by up to ", largest)
    elif movement.failed_before:
        trials = counted(movement.failed_before, "failed trial")
        errors = say("{} did not fail when evaluated again", trials)
    third = (
        f"; evaluated a third time, {movement.moved_third} of {movement.third} moved"
    )
    jumps = "rates jump inside steps"
    if movement.jumped_over and not (movement.moved or movement.moved_third):
        return text(jumps)
    return text(
        errors,
        third if movement.moved_third else None,
        f"; {jumps}" if movement.jumped_over else None,
    )


def _numbers(warning: NumbersWarning) -> Parts:
    exact = warning.scale._replace(least=0.0)
    (name, wrong), *others = warning.numbers.items()
    more = f", and {len(others)} more" if others else None
    return say(f"{{}}: {name} {{}}, integration error {{}}{{}}",
               Name(warning.response), Number(wrong.number, exact),
               Number(wrong.error, exact), more)  # fmt: skip


def _errors(warning: ErrorsWarning) -> Parts:
    named = [
        say("{} by up to {} ({} sigma)", Name(name),
            Number(visible.error, visible.scale._replace(least=0.0)),
            Number(visible.of_sigma))
        for name, visible in warning.responses.items()
    ]  # fmt: skip
    others = len(named) - MOST_ERRORS
    more = [text(f"{others} more")] if others > 0 else []
    return say("Integration errors: {}. A smaller rtol or max_step in [settings] "
               "removes them.", listed([*named[:MOST_ERRORS], *more]))  # fmt: skip
