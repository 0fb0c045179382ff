"""Documents of checks: of a stored run, and of this computer."""

from pathlib import Path

import numpy as np

from tolstat.answers.next_steps import to_resume, to_run_again
from tolstat.document.blocks import Document, Facts, Paragraph, paragraph, table_of
from tolstat.document.inline import Parts, Typed, counted, listed, text
from tolstat.execution.compatibility import why_sampled_differently
from tolstat.execution.verification import Check, Verification
from tolstat.status import Status
from tolstat.store.integrity import ranges_of


def verified_document(path: Path, verification: Verification) -> Document:
    """Return the differences of a run from what was written, and the next step."""
    run = verification.run
    stored = int(np.count_nonzero(run.status != Status.NOT_RUN))
    counts = [f"{count} {word}" for word, count in run.counts.items() if count]
    rows: list[tuple[str, Parts]] = [
        (f"{run.trials} trials", listed(counts, "")),
        (f"checksums of {stored} trials and the nominal trial",
         text(run.damage.words or "all fit")),
    ]  # fmt: skip
    for what, trials in (
        ("status and responses", verification.contradicting),
        (
            f"deviations of {run.trials} trials, sampled again",
            verification.drawn_otherwise,
        ),
        (
            f"{len(verification.evaluated)} trials, evaluated again",
            verification.different,
        ),
        (f"{len(verification.alone)} of them, each alone", verification.dependent),
    ):
        words = f"different in {ranges_of(trials)}" if len(trials) else "as stored"
        rows.append((what, text(words)))
    if verification.nominal_differs:
        rows.append(("nominal trial, evaluated again", text("different")))
    redrawn = run.aim and len(
        verification.drawn_otherwise
    )  # samples depend on the computer
    reasons = []
    if len(verification.different) or verification.nominal_differs or redrawn:
        reasons = [paragraph(each) for each in verification.reasons]
    return Document("", (Facts(tuple(rows)), *reasons, _conclusion(path, verification)))


def _conclusion(path: Path, verification: Verification) -> Paragraph:
    run = verification.run
    if verification.whole:
        return paragraph(f"{path} is as it was written")
    if run.damage:
        repair = Typed(to_resume(path, run.machine))
        return paragraph(f"{path} is damaged. Repair it with: ", repair)
    why = "its data or its program differ"
    if not verification.reasons:
        why += ", or an answer depends on the other trials of its block"
    if run.aim and len(verification.drawn_otherwise):
        why = why_sampled_differently(run)
    again = to_run_again(run)
    return paragraph(
        f"{path} is as it was written, but its study has other results here: {why}",
        ". Run its study again",
        text(": ", Typed(again)) if again else ".",
    )


def surroundings_document(places: dict[str, str]) -> Document:
    """Return versions, processor, cores, and where compiled code is kept."""
    rows = [{"what": what, "here": here} for what, here in places.items()]
    return Document("", (table_of(rows, words=["here"]),))


def check_document(check: Check) -> Document:
    """Return how fast trials are evaluated, and whether they repeat bit for bit."""
    same = "the same trials have the same responses, bit for bit"
    if not check.same:
        same = (
            "the same trials have different responses: memory, processor or compiled "
            "code is damaged; remove the folder of compiled code above, and try again"
        )
    speed = paragraph(
        f"ready after {check.ready:.1f} s; ", *counted(check.trials, "trial"),
        f" of the stand in {check.seconds:.1f} s: "
        f"{check.trials / check.seconds:.0f} trials/s",
    )  # fmt: skip
    return Document("", (speed, paragraph(same)))
