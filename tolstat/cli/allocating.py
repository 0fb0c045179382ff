"""Tolerances allocated: what was found on the screen, as a study, as a picture."""

from __future__ import annotations

import os
import sys
import tomllib
from collections import Counter
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as Bar

from tolstat.answers.allocate.allocate_tolerances import allocated, to_prove_again
from tolstat.answers.allocate.allocation import Allocation, Scheme
from tolstat.answers.pages import (
    check_view_ending,
    save_view,
    write,
)
from tolstat.answers.report.summary_table import Cell, estimate_in_words
from tolstat.catalogue import place_of
from tolstat.cli.interrupting import INTERRUPTED, stop_on_interrupt
from tolstat.cli.power import Power
from tolstat.cli.showing import Screen, print_table, screen
from tolstat.errors import RunFileError, StudyError
from tolstat.execution.run_loop import Progress
from tolstat.execution.workers.crew import Interrupted
from tolstat.render.output_file import check_folder
from tolstat.render.plain import as_json
from tolstat.study.study import Study, load
from tolstat.units.scale import PPM, figures

SENTENCE = "cost of the cheapest tolerances over the machines beyond any limit"


def allocate_study(
    path: Path,
    power: Power,
    *,
    trials: int | None,
    output: Path | None,
    plot: Path | None,
    json: bool,
    force: bool,
) -> bool:
    """Allocate the tolerances of a study, and say what came of it.

    Parameters
    ----------
    path : Path
        The study.
    power : Power
        Who evaluates.
    trials : int, optional
        Of the wide run, and of each proof at its first look.
    output, plot : Path, optional
        Where the study with the tolerances found goes, and the picture of the
        trade-off.
    json : bool
        Whether the numbers go to the standard output instead of tables.
    force : bool
        Whether an existing study may be replaced.

    Returns
    -------
    bool
        Whether a fresh run showed that they meet every limit.
    """
    study = load(path)
    if output:
        _check_output(output, path, force=force)
        _check_data(output, study)
    if plot:
        check_view_ending(plot)
    bar = Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        console=Screen(stderr=True),
        transient=True,
    )
    with stop_on_interrupt() as stop:
        try:
            with bar, power.crew(stop.is_set) as crew:
                task = bar.add_task("compiling, if need be", total=None)

                def tell(progress: Progress) -> None:
                    if progress.doubt:
                        bar.print(f"note: {progress.doubt}", soft_wrap=True)
                        return
                    total = progress.asked or None
                    bar.update(
                        task, description=progress.doing, total=total,
                        completed=progress.over,
                    )  # fmt: skip

                found = allocated(
                    study, crew, trials=trials, progress=tell, output=output
                )
        except Interrupted:
            _leave()
        # a Ctrl-C from here on waits until whole files are written
        if output and found.met:
            write(output, found.text)
        if plot:
            save_view(found.curve, plot, f"{study.title}: cost over ppm", SENTENCE)
        if json:
            sys.stdout.write(as_json(_plain(found)))
        else:
            _print(found, output, plot, place_of(study.model))
        if stop.is_set():
            sys.stdout.flush()
            os._exit(INTERRUPTED)
    return found.met


def _leave() -> None:
    """End the process; nothing was written."""
    sys.stderr.write("stopped: nothing is written\n")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


def _check_output(output: Path, study: Path, *, force: bool) -> None:
    """Refuse a file that the study cannot be written to, before anything runs."""
    check_folder(output)
    if output.suffix != ".toml":
        raise RunFileError(f"{output}: a study ends in .toml")
    if output.exists() and (not force or output.resolve() == study.resolve()):
        other = "give another name" if not force else "it is the study itself"
        raise RunFileError(
            f"{output} exists already; {other}, or replace it by --force"
        )


def _check_data(output: Path, study: Study) -> None:
    """Refuse a folder where the study would not read the parts that it reads here."""
    reason = "data of that name are others there"
    try:
        table, folder = tomllib.loads(study.text), output.parent
        there = load(table, model=study.model, folder=folder).deviating.notes
    except StudyError as error:
        there, reason = (), str(error)
    if there != study.deviating.notes:
        raise RunFileError(
            f"{output} would not be this study, which reads files of its own folder: "
            f"{reason}; write it beside {study.path}, or copy them there first"
        )


def _plain(found: Allocation) -> dict[str, object]:
    """Return what came of an allocation, for JSON."""
    plain = found._asdict()
    for name in ("text", "curve"):
        del plain[name]
    cost, tolerances = plain.pop("cost"), plain.pop("tolerances")
    curve = found.curve.frame()
    plain["trade_off"] = [
        {"beyond": beyond, "cost": cost}
        for beyond, cost in zip(
            curve.index.tolist(), curve["cheapest"].tolist(), strict=True
        )
    ]
    return {"cost": cost, "tolerances": tolerances, **plain}


def _print(
    found: Allocation, output: Path | None, plot: Path | None, machine: str
) -> None:
    """Print the tables: what was found, the proof, and what lies beside it."""
    console = screen()
    heads = ["contributor", "parts", "as drawn", "cost", "found", "cost ", "note"]
    if not found.met:
        heads[4] = "tightest"
    rows = [
        [
            line.name, f"{line.parts}", line.drawn, figures(line.cost_drawn),
            line.found, figures(line.cost), _note(line.at_loosest, line.free),
        ]
        for line in found.lines
    ]  # fmt: skip
    drawn = sum(line.cost_drawn for line in found.lines)
    rows.append(["all", "", "", figures(drawn), "", figures(found.cost), ""])
    print_table("tolerances", heads, [[*row] for row in rows], wide=True)
    heads = [
        "",
        "cost",
        "beyond any limit, ppm",
        *(f"{name}, ppm" for name in found.verdicts),
        "fresh run",
    ]
    rows_of = {**found.schemes} | ({"its proof": found.proof} if found.met else {})
    shown: list[list[Cell]] = [
        [
            name, figures(scheme.cost), estimate_in_words(scheme.beyond_any, PPM),
            *(estimate_in_words(scheme.beyond[n], PPM) for n in found.verdicts),
            _by(scheme),
        ]
        for name, scheme in rows_of.items()
    ]  # fmt: skip
    print_table("machines beyond the limits", heads, shown, wide=True)
    for line_of_text in _sentences(found):
        console.print(line_of_text, soft_wrap=True)
    if output and found.met:
        said = f"written to {output}"
        if found.again:
            again = to_prove_again(output, found.proof, machine)
            said += f"; the proof again: {again}"
        console.print(said, soft_wrap=True)
    elif output:
        console.print(
            f"{output} is not written: no tolerances were shown to meet every limit"
        )
    if plot:
        console.print(f"drawn in {plot}")


def _note(at_loosest: bool, free: bool) -> str:
    said = ["at its loosest"] * at_loosest + ["costs no yield"] * free
    return ", ".join(said)


def _in_line(cell: Cell) -> str:
    return cell if isinstance(cell, str) else "{} ({}..{})".format(*cell)


def _by(scheme: Scheme) -> str:
    return f"{scheme.trials}, seed {scheme.seed}"


def _sentences(found: Allocation) -> list[str]:
    """Say what was shown, and what decides."""
    said = []
    if found.met:
        proof = found.proof
        said.append(
            f"cost {proof.cost:.4g}: every limit is met in a fresh run of "
            f"{proof.trials} machines (the whole 95 % interval of each yield lies at "
            "or above what is demanded)"
        )
        said.append(
            '"its proof" is that run, and its verdicts count; "found" is the same '
            "tolerances run once more, with the seed of the other rows, by which "
            "nothing was chosen: to be compared with them"
        )
    else:
        missed = [f"{n}: {v}" for n, v in found.verdicts.items() if v != "met"]
        beyond = found.proof.beyond
        best = ", ".join(
            f"{n} {_in_line(estimate_in_words(beyond[n], PPM))} ppm"
            for n, v in found.verdicts.items()
            if v != "met"
        )
        said.append(
            "no tolerances were shown to meet every limit; with all of them at their "
            f"tightest {'; '.join(missed)} ({best} beyond)"
        )
    if found.active and found.met:
        said.append(
            f"active: {', '.join(found.active)} (with some tolerance a tenth looser, "
            "as far as it may be, or the next one offered, it is not shown to be met)"
        )
    return [*said, *found.notes, _made(found)]


def _made(found: Allocation) -> str:
    """Say how many machines were made for it."""
    counted = Counter(found.fresh_runs)
    runs = ", ".join(
        f"{counted[trials]} of {trials} machines" for trials in sorted(counted)
    )
    return (
        f"made for it: {found.wide_run} machines drawn wide, and "
        f"{len(found.fresh_runs)} fresh runs: {runs}"
    )
