"""Document of one trial simulated again."""

from collections.abc import Iterator

from tolstat.answers.views.replay import Replay
from tolstat.document import blocks
from tolstat.document.inline import Name
from tolstat.document.sentences import listed
from tolstat.document.view_content import plot_of


def replay_document(trial: Replay) -> blocks.Document:
    """Return deviations, responses, and whether these are as stored."""
    moved = {name: part for name, part in trial.contributors.items() if part.value}
    inputs: list[dict[str, blocks.Given]] = [
        {"contributor": Name(name), "deviation": part.words, "": part.sentence}
        for name, part in (*trial.settings.items(), *moved.items())
    ]
    responses: list[dict[str, blocks.Given]] = [
        {
            "response": Name(name),
            "value": response.words,
            "limit": response.limit + ": out of limit" * response.out_of_limit,
        }
        for name, response in trial.responses.items()
    ]
    steps = None if trial.steps is None else f"{trial.steps} steps"
    ended = f"{trial.title}: {trial.status}"
    title = ", ".join(filter(None, [ended, steps, trial.failed_at]))
    return blocks.Document(title, blocks.shown(
        blocks.table_of(inputs, words=[""]),
        blocks.table_of(responses, words=["limit"]),
        *_remarks(trial),
    ))  # fmt: skip


def _remarks(trial: Replay) -> Iterator[blocks.Block]:
    """Say whether the trial is as stored, and show how it moved or what it printed."""
    if trial.output:
        yield blocks.Verbatim(trial.output)
    if trial.differences:
        why = f": {trial.reason}" if trial.reason else ""
        words = f"not bit for bit as stored{why}; different: "
        yield blocks.paragraph(words, listed(trial.differences, ""))
    elif trial.stored:
        yield blocks.paragraph("bit for bit as stored")
    if trial.damage:
        words = f"the run is damaged: {trial.damage}. Repair it with: "
        yield blocks.paragraph(words, trial.repair)
    if trial.history:
        yield blocks.Figure("its histories", plot_of(trial.history), wide=True)
