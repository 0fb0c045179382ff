"""What settles a verdict that integration errors leave undecided: a finer run."""

from collections.abc import Sequence

from tolstat.answers.next_steps import as_typed, to_run_again, typed_setting
from tolstat.answers.sampled_trials import audited_of
from tolstat.document.inline import Name, Parts, Typed, Word, listed, say, text
from tolstat.store.stored_run import Run

SHORT = " (max_step below the shortest event, or a mark where one begins and ends)"
MOST_RTOL = 1e-6  # the audit of a far too rough run is too rough as well


def settle(run: Run, limits: Sequence[str]) -> Parts:
    """Say with which settings a new run decides limits; empty without limits."""
    if not limits or run.audited is None:
        return ()
    again, lines, audited = to_run_again(run), [], run.audited
    every = [audited_of(run, name) for name in limits]
    unsettled = any(each.unsettled.any() for each in every if each)
    settings = dict(audited.settings)
    if audited.third and unsettled:  # rtol alone finds no event that steps miss
        longest = "max_step" if "max_step" in settings else "rtol"
        settings[longest] = audited.third.settings[longest]
    for name, value in settings.items():
        wanted = min(value, MOST_RTOL) if name == "rtol" else value
        lines.append(f"{name} = {typed_setting(run, name, wanted)}")
    study = as_typed(run.study_file) if again and run.study_file else "the study"
    return say(
        "Decide {}, whose integration errors are too large: write {} into [settings] "
        "of {}{}, then run it again{}.",
        listed([Name(name) for name in limits]), listed([Word(x) for x in lines]),
        f"{study}", SHORT if "max_step" in settings else None,
        text(": ", Typed(again)) if again else None,
    )  # fmt: skip
