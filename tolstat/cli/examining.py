"""What tolstat runs on here, on the screen."""

from __future__ import annotations

from tolstat.cli.showing import print_words, screen, words_table
from tolstat.execution.self_check import check, surroundings


def examine() -> bool:
    """Print what tolstat runs on; tell whether the same machines answer the same."""
    table = words_table("", "what", "here")
    for what, words in surroundings().items():
        table.add_row(what, words)
    print_words(table)
    console = screen()
    found = check()
    console.print(
        f"ready after {found.ready:.1f} s; {found.trials} machines of the stand in "
        f"{found.seconds:.1f} s: {found.trials / found.seconds:.0f} trials/s"
    )
    if found.same:
        console.print("the same machines have the same answers, bit for bit")
    else:
        console.print(
            "the same machines have different answers: memory, processor or compiled "
            "code is damaged; remove the folder of the last, above, and look again"
        )
    return found.same
