"""What a comparison says: significant differences, then each design less the first."""

from __future__ import annotations

from collections.abc import Iterator

from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm, verdict_cell
from tolstat.answers.compare.comparison import (
    COMPARED,
    Comparison,
    Design,
    Difference,
)
from tolstat.answers.compare.comparison_figures import figures_of
from tolstat.answers.compare.pairing import Pair
from tolstat.document.blocks import (
    Block,
    Bullets,
    Cell,
    Column,
    Document,
    Facts,
    Gallery,
    Given,
    Paragraph,
    Section,
    Table,
    note,
    paragraph,
    table,
)
from tolstat.document.inline import Name, Number, Parts, counted, listed, text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.summary import QUANTILES
from tolstat.units.scale import PER_CENT, share_words

SIGNIFICANT = {
    -1: "significantly fewer trials out of the limit of ",
    1: "significantly more trials out of the limit of ",
    0: "no significant difference in trials out of the limit of ",
}
PROVENANCE = ("run", "model", "started_at", "source_digest", "version_tolstat")


def comparison_document(found: Comparison) -> Document:
    """Return the document of a comparison."""
    designs = tuple(
        (each.label, text(f"{each.title} ({each.run}): ", _trials(each)))
        for each in found.designs
    )
    blocks: list[Block] = [Section("", (*_lead(found), Facts(designs)))]
    if rows := [*_verdict_rows(found)]:
        blocks.append(_verdicts(found, rows))
    for pair, one in zip(found.pairs, found.differences, strict=True):
        blocks += _difference(found, pair, one)
    blocks.append(_provenance(found))
    runs = tuple(each.run for each in found.designs)
    return Document(
        " | ".join(each.title for each in found.designs), tuple(blocks), runs
    )


def _trials(design: Design) -> Parts:
    done = counted(design.done, "trial")
    return text(done, " done, ", Number(design.failed), " failed")


def _of_each(found: Comparison) -> Parts:
    """Say how many trials the numbers of each design rest on."""
    each = [text(f"{design.label}: ", _trials(design)) for design in found.designs]
    return _joined(each)


def _joined(said: list[Parts]) -> Parts:
    return text(*(text("; ", each) if i else each for i, each in enumerate(said)))


def _of_both(found: Comparison, one: Difference) -> Parts:
    """Say how many trials the numbers of a difference rest on."""
    if not one.paired:
        return text("unpaired; ", _of_each(found))
    done = counted(one.pairing.done_in_both, "trial")
    failed = Number(one.pairing.failed)
    return text(done, f" done in A and in {one.design}, ", failed, " failed in either")


def _lead(found: Comparison) -> Iterator[Block]:
    """Lead with the limits on which designs differ significantly."""
    said = []
    for one in found.differences:
        signs: dict[int, list[Name]] = {}
        for name, each in one.limits.items():
            signs.setdefault(each.significant, []).append(Name(name))
        groups = [
            text(words, listed(signs[sign]))
            for sign, words in SIGNIFICANT.items()
            if sign in signs
        ]
        if groups:
            said.append(text(f"{one.design} less A: ", _joined(groups), "."))
    if said:
        yield Bullets(tuple(said))
    else:
        yield Paragraph(text("No study limits a response."), "lead")


def _verdict_rows(found: Comparison) -> Iterator[list[Given]]:
    for name in found.responses:
        for design in found.designs:
            each = design.responses.get(name)
            if each and (limited := each.limited):
                yield [
                    text(Name(name), f" {design.label}"), limit_cell(limited.limit),
                    verdict_cell(limited.yields), ppm(limited.yields.out_of_limit),
                    ppk_cell(limited.equivalent),
                ]  # fmt: skip


def _verdicts(found: Comparison, rows: list[list[Given]]) -> Table:
    return table(
        ["response", "limit", "verdict", "out of limit, ppm", "equivalent Ppk"],
        rows,
        "Verdicts",
        caption=_of_each(found),
        look="verdicts",
        page_only=True,
    )


def _difference(found: Comparison, pair: Pair, one: Difference) -> Iterator[Block]:
    """Return what is said of a design less the first."""
    yield Section(f"{one.design} less A", (*_pairing(one), *_tables(found, one)))
    for name in one.focus:
        yield _in_focus(found, pair, one, name)


def _pairing(one: Difference) -> Iterator[Paragraph]:
    """Say how the trials are paired, and what else differs."""
    how = one.pairing
    if one.paired:
        done = Number(how.done_in_both)
        yield note(
            f"{how.kind} ({how.words}). ", done, " of ", counted(how.trials, "trial"),
            " are done in both.",
        )  # fmt: skip
    else:
        yield note(
            f"{how.kind} ({how.words}); not trial by trial: differences of means, "
            "quantiles and fractions."
        )
    for what, differing in (("Settings", one.settings), ("Deviations", one.deviations)):
        if differing:
            yield note(f"{what} that differ: ", changes(differing), ".")


def _tables(found: Comparison, one: Difference) -> Iterator[Block]:
    if one.limits:
        yield _limits(found, one)
    yield _responses(found, one)
    if one.paired:
        yield _trial_by_trial(found, one)
    yield note(
        "Below each number stands its 95 % interval: ", one.pairing.promise, ". ",
        "A design without a limit is judged by that of the other. ",
        "Worse: trials within in A and out of limit in ", one.design, "; better: the "
        "other way round. " if one.paired else None,
        "The interval of a mean assumes that no difference lies farther out than twice "
        "the spread of these.",
    )  # fmt: skip


def _limits(found: Comparison, one: Difference) -> Table:
    b, paired = one.design, one.paired
    sides = ["worse", "better"] if paired else []
    rows = []
    for name, each in one.limits.items():
        other = each.limits[1] if each.limits[0] != each.limits[1] else ""
        row: list[Given] = [
            Name(name),
            Cell(text(each.limits[0]), text(f"{b}: {other}") if other else ()),
            *(ppm(x) for x in each.fractions_out_of_limit),
            ppm(each.fraction_difference),
        ]
        if paired:
            row += [Number(x) for x in (each.worse, each.better) if x is not None]
        row += [ppk_cell(x) for x in each.equivalent_ppk]
        row += [
            ppk_cell(each.equivalent_ppk_difference),
            ppk_cell(each.ppk_difference_by_moments),
        ]
        rows.append(row)
    return table(
        [
            "response", "limit", "ppm: A", f"ppm: {b}", f"ppm: {b} - A", *sides,
            "Ppk: A", f"Ppk: {b}", f"Ppk: {b} - A",
            Column(f"Ppk by moments: {b} - A", page_only=True),
        ],
        rows,
        "Out of limit, and equivalent Ppk",
        caption=_of_both(found, one),
        look="dense",
    )  # fmt: skip


def _responses(found: Comparison, one: Difference) -> Table:
    a, b = found.of(one)
    share, paired = share_words(0.95), one.paired
    sides = [
        f"smaller in {b.label}, %",
        Column(f"larger in {b.label}, %", page_only=True),
    ]
    rows = []
    for name, each in one.responses.items():
        scale = found.responses[name].scale
        numbers = [
            *(design.responses[name].quantiles[0.95] for design in (a, b)),
            each.mean,
            *each.quantiles.values(),
        ]
        row: list[Given] = [
            Name(name),
            scale.mark,
            *(Number(x, scale) for x in numbers),
        ]
        if paired:
            row += [Number(x, PER_CENT) for x in (each.smaller, each.larger)]
        rows.append(row)
    less = f"{b.label} - A"
    return table(
        [
            "response", "unit", f"A: {share}", f"{b.label}: {share}",
            Column(f"{less}: mean", page_only=True),
            *(f"{less}: {share_words(q)}" for q in COMPARED),
            *(sides if paired else ()),
        ],
        rows,
        "Responses",
        caption=text(
            _of_each(found), ". Differences: ", _of_both(found, one),
            f". {less}: of quantiles, their difference",
        ),
        keys=2,
        look="dense",
    )  # fmt: skip


def _trial_by_trial(found: Comparison, one: Difference) -> Table:
    rows: list[list[Given]] = []
    for name, each in one.responses.items():
        scale, of = found.responses[name].scale, each.trial_by_trial
        assert of is not None
        numbers: list[Estimate | float]
        numbers = [of.mean, of.least, *of.quantiles.values(), of.largest]
        rows.append([Name(name), scale.mark, *(Number(x, scale) for x in numbers)])
    return table(
        ["response", "unit", "mean", "least", *map(share_words, QUANTILES), "largest"],
        rows,
        "Differences trial by trial",
        caption=_of_both(found, one),
        keys=2,
        look="dense",
        page_only=True,
    )


def _in_focus(found: Comparison, pair: Pair, one: Difference, name: str) -> Section:
    """Return the quantiles and the figures of a response."""
    (a, b), each = found.of(one), one.responses[name]
    sentence, scale = found.responses[name]

    def row(design: Design) -> list[Given]:
        of = design.responses[name]
        numbers: list[Estimate | float] = [of.nominal, *of.quantiles.values()]
        return [design.label, *(Number(x, scale) for x in numbers)]

    known = (each.quantiles.get(q) for q in QUANTILES)
    less = [f"{b.label} - A", None, *(x and Number(x, scale) for x in known)]
    heads = ["design", "nominal", *map(share_words, QUANTILES)]
    return Section(
        f"{name}, {b.label} and A",
        (
            paragraph(sentence, f", {scale.mark}" if scale.mark else None),
            table(
                heads,
                [row(a), row(b), less],
                caption=_of_each(found),
                look="dense",
            ),
            Gallery(tuple(figures_of(found, pair, one, name))),
        ),
        anchor=f"{b.label}-{name}",
        page_only=True,
    )


def _provenance(found: Comparison) -> Section:
    rows = [
        [key.replace("_", " "), *(getattr(each, key) for each in found.designs)]
        for key in PROVENANCE
    ]
    heads = [Column(each.label, words=True) for each in found.designs]
    return Section("Provenance", (table(["", *heads], rows),), page_only=True)
