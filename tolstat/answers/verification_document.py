"""Documents of checks: of a stored run, and of this computer."""

from pathlib import Path

import numpy as np

from tolstat.answers.next_steps import to_resume, to_run_again
from tolstat.document import blocks
from tolstat.document.sentences import counted, listed, text
from tolstat.execution.compatibility import why_sampled_differently
from tolstat.execution.self_check import Check
from tolstat.execution.verification import Verification
from tolstat.status import Status
from tolstat.store.integrity import ranges_of


def verified_document(path: Path, verification: Verification) -> blocks.Document:
    """Return the differences of a run from what was written, and the next step."""
    run, check = verification.run, verification
    stored = int(np.count_nonzero(run.status != Status.NOT_RUN))
    counts = [f"{count} {word}" for word, count in run.counts.items() if count]
    rows = {
        f"{run.trials} trials": listed(counts, ""),
        f"checksums of {stored} trials and the nominal trial": text(
            run.damage.words or "all fit"
        ),
    }
    if check.file:
        rows["file of the rows"] = text(check.file)
    sampled = "read" if check.file else "sampled"
    evaluated = "evaluated" if len(check.alone) else "read"
    findings = {
        "status and responses": check.contradicting,
        f"deviations of {run.trials} trials, {sampled} again": check.drawn_otherwise,
        f"{len(check.evaluated)} trials, {evaluated} again": check.different,
        f"{len(check.alone)} of them, each alone": check.dependent,
    }
    for check_words, trials in findings.items():
        words = f"different in {ranges_of(trials)}" if len(trials) else "as stored"
        rows[check_words] = text(words)
    if check.nominal_differs:
        rows["nominal trial, evaluated again"] = text("different")
    # samples of a rare run depend on the computer
    redrawn = run.aim and len(check.drawn_otherwise)
    differs = len(check.different) or check.nominal_differs or redrawn
    reasons = map(blocks.paragraph, check.reasons if differs else ())
    facts = blocks.Facts(tuple(rows.items()))
    return blocks.Document("", (facts, *reasons, _conclusion(path, check)))


def _conclusion(path: Path, verification: Verification) -> blocks.Paragraph:
    run = verification.run
    if verification.whole:
        return blocks.paragraph(f"{path} is as it was written")
    if run.damage:
        repair = to_resume(path, run.machine)
        return blocks.paragraph(f"{path} is damaged. Repair it with: ", repair)
    why = "its data or its program differ"
    if not verification.reasons:
        why += ", or an answer depends on the other trials of its block"
    if run.aim and len(verification.drawn_otherwise):
        why = why_sampled_differently(run)
    again = to_run_again(run)
    return blocks.paragraph(
        f"{path} is as it was written, but its study has other results here: {why}",
        ". Run its study again",
        text(": ", again) if again else ".",
    )


def surroundings_document(places: dict[str, str]) -> blocks.Document:
    """Return versions, processor, cores, and where compiled code is kept."""
    rows = [{"what": fact, "here": value} for fact, value in places.items()]
    return blocks.Document("", (blocks.table_of(rows, words=["here"]),))


def check_document(check: Check) -> blocks.Document:
    """Return how fast trials are evaluated, and whether they repeat bit for bit."""
    same = "the same trials have the same responses, bit for bit"
    if not check.same:
        same = (
            "the same trials have different responses: memory, processor or compiled "
            "code is damaged; remove the folder of compiled code above, and try again"
        )
    speed = blocks.paragraph(
        f"ready after {check.ready:.1f} s; ", *counted(check.trials, "trial"),
        f" of the stand in {check.seconds:.1f} s: "
        f"{check.trials / check.seconds:.0f} trials/s",
    )  # fmt: skip
    return blocks.Document("", (speed, blocks.paragraph(same)))
