"""Document of a comparison: significant differences, each design less the first."""

from collections.abc import Mapping

from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm, verdict_cell
from tolstat.answers.compare.comparison import Comparison, Design, Difference
from tolstat.answers.compare.comparison_figures import figures_of
from tolstat.answers.report.finding_words import sentences
from tolstat.document import blocks
from tolstat.document.blocks import Cell, Given, Section, Table, note, table_of
from tolstat.document.inline import Name, Number, Parts, counted, listed, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import PER_CENT, Scale, share_words

SIGNIFICANT = {
    -1: "significantly fewer trials out of the limit of ",
    1: "significantly more trials out of the limit of ",
    0: "no significant difference in trials out of the limit of ",
}
PROVENANCE = ("run", "model", "started_at", "source_digest", "version_tolstat")


def comparison_document(found: Comparison) -> blocks.Document:
    """Return the document of a comparison."""
    designs = tuple(
        (each.label, say("{} ({}): {}", each.title, each.run, _trials(each)))
        for each in found.designs
    )
    return blocks.Document(
        " | ".join(each.title for each in found.designs),
        (
            Section("", (*_warnings(found), _lead(found), blocks.Facts(designs))),
            *blocks.shown(_verdicts(found)),
            *(each for one in found.differences for each in _difference(found, one)),
            _provenance(found),
        ),
        tuple(each.run for each in found.designs),
    )


def _warnings(found: Comparison) -> tuple[blocks.Block, ...]:
    """Return the warnings of all runs, each with its design."""
    said = [
        text(f"{design.label}: ", *parts)
        for design in found.designs
        for parts in sentences(design.warnings)
    ]
    return (blocks.Bullets(tuple(said)),) if said else ()


def _trials(design: Design) -> Parts:
    done = counted(design.done, "trial")
    return say("{} done, {} failed", done, Number(design.failed))


def _of_each(found: Comparison) -> Parts:
    """Say how many trials the numbers of each design rest on."""
    return _joined([text(f"{each.label}: ", _trials(each)) for each in found.designs])


def _joined(said: list[Parts]) -> Parts:
    return text(*(text("; ", each) if i else each for i, each in enumerate(said)))


def _of_both(found: Comparison, one: Difference) -> Parts:
    """Say how many trials the numbers of a difference rest on."""
    if not one.pairing.paired:
        return text("unpaired; ", _of_each(found))
    done = counted(one.pairing.done_in_both, "trial")
    said = "{} done in A and in {}, {} failed in either"
    return say(said, done, one.design, Number(one.pairing.failed))


def _lead(found: Comparison) -> blocks.Block:
    """Return the limits on which designs differ significantly."""
    said = []
    for one in found.differences:
        groups = [
            text(words, listed([Name(n) for n in names]))
            for sign, words in SIGNIFICANT.items()
            if (names := [n for n, x in one.limits.items() if x.significant == sign])
        ]
        if groups:
            said.append(text(f"{one.design} less A: ", _joined(groups), "."))
    if said:
        return blocks.Bullets(tuple(said))
    return blocks.Paragraph(text("No study limits a response."), "lead")


def _verdicts(found: Comparison) -> Section:
    rows: list[dict[str, Given]] = [
        {
            "response": text(Name(name), f" {design.label}"),
            "limit": limit_cell(limited.limit),
            "verdict": verdict_cell(limited.yields),
            "out of limit, ppm": ppm(
                limited.yields.fraction_out_of_limit, design.done + design.failed
            ),
            "equivalent Ppk": ppk_cell(limited.equivalent_ppk),
        }
        for name in found.responses
        for design in found.designs
        if (each := design.responses.get(name)) and (limited := each.limited)
    ]
    table = table_of(rows, "Verdicts", caption=_of_each(found), look="verdicts")
    return Section("", blocks.shown(table), page_only=True)


def _difference(found: Comparison, one: Difference) -> list[Section]:
    """Return the sections about a design less the first."""
    said = blocks.shown(
        _pairing(one),
        _that_differ("Settings", one.settings),
        _that_differ("Deviations", one.deviations),
        _limits(found, one),
        _responses(found, one),
        _trial_by_trial(found, one),
        _reading(one),
    )
    focus = [_in_focus(found, one, name) for name in one.focus]
    return [Section(f"{one.design} less A", said), *focus]


def _pairing(one: Difference) -> blocks.Paragraph:
    """Say how the trials are paired."""
    how = one.pairing
    if not how.paired:
        return note(
            f"{how.kind} ({how.words}); not trial by trial: differences of means, "
            "quantiles and fractions."
        )
    of = Number(how.done_in_both), " of ", counted(how.trials, "trial")
    return note(f"{how.kind} ({how.words}). ", of, " are done in both.")


def _that_differ(
    what: str, differing: Mapping[str, tuple[str, str]]
) -> blocks.Paragraph | None:
    return note(f"{what} that differ: ", changes(differing), ".") if differing else None


def _reading(one: Difference) -> blocks.Paragraph:
    """Return the note for readers of the tables."""
    return note(
        f"Each number has its 95 % interval below it: {one.pairing.promise}. ",
        "A design without a limit is judged by that of the other. ",
        f"Worse: trials within in A and out of limit in {one.design}; better: the "
        "other way round. " if one.pairing.paired else None,
        "The interval of a mean assumes that no difference lies farther out than twice "
        "the spread of these.",
    )  # fmt: skip


def _limits(found: Comparison, one: Difference) -> Table:
    b = one.design
    by_moments = f"Ppk by moments: {b} - A"
    rows: list[dict[str, Given]] = []
    both = one.pairing.done_in_both + one.pairing.failed
    of = [both or design.done + design.failed for design in found.of(one)]
    for name, each in one.limits.items():
        first, other = each.limits
        rows.append({
            "response": Name(name),
            "limit": Cell(text(first), text(f"{b}: {other}") if other != first else ()),
            "ppm: A": ppm(each.fractions_out_of_limit[0], of[0]),
            f"ppm: {b}": ppm(each.fractions_out_of_limit[1], of[1]),
            f"ppm: {b} - A": ppm(each.fraction_out_of_limit_difference),
            "worse": None if each.worse is None else Number(each.worse),
            "better": None if each.better is None else Number(each.better),
            "Ppk: A": ppk_cell(each.equivalent_ppks[0]),
            f"Ppk: {b}": ppk_cell(each.equivalent_ppks[1]),
            f"Ppk: {b} - A": ppk_cell(each.equivalent_ppk_difference),
            by_moments: ppk_cell(each.moments_ppk_difference),
        })  # fmt: skip
    return table_of(
        rows, "Out of limit, and equivalent Ppk", page_only=[by_moments],
        caption=_of_both(found, one), look="dense",
    )  # fmt: skip


def _responses(found: Comparison, one: Difference) -> Table:
    (a, b), share = found.of(one), share_words(0.95)
    less, larger = f"{b.label} - A", f"larger in {b.label}, %"
    rows: list[dict[str, Given]] = []
    for name, each in one.responses.items():
        scale, of_a, of_b = found.responses[name].scale, a.responses, b.responses
        row: dict[str, Given] = {
            "response": Name(name),
            "unit": scale.mark,
            f"A: {share}": Number(of_a[name].quantiles[0.95], scale),
            f"{b.label}: {share}": Number(of_b[name].quantiles[0.95], scale),
            f"{less}: mean": Number(each.mean, scale),
        }
        for q, found_at in each.quantiles.items():
            row[f"{less}: {share_words(q)}"] = Number(found_at, scale)
        if one.pairing.paired:
            both = one.pairing.done_in_both
            row[f"smaller in {b.label}, %"] = Number(each.smaller, PER_CENT, of=both)
            row[larger] = Number(each.larger, PER_CENT, of=both)
        rows.append(row)
    caption = say(
        f"{{}}. Differences: {{}}. {less}: of quantiles, their difference",
        _of_each(found), _of_both(found, one),
    )  # fmt: skip
    return table_of(
        rows, "Responses", page_only=[f"{less}: mean", larger], caption=caption,
        keys=2, look="dense",
    )  # fmt: skip


def _trial_by_trial(found: Comparison, one: Difference) -> Section:
    rows: list[dict[str, Given]] = []
    for name, each in one.responses.items():
        if of := each.trial_by_trial:
            scale = found.responses[name].scale
            row: dict[str, Given] = {"response": Name(name), "unit": scale.mark}
            row |= {"mean": Number(of.mean, scale), "least": Number(of.least, scale)}
            row |= _quantiles(of.quantiles, scale)
            rows.append({**row, "largest": Number(of.largest, scale)})
    table = table_of(
        rows, "Differences trial by trial", caption=_of_both(found, one), keys=2,
        look="dense",
    )  # fmt: skip
    return Section("", blocks.shown(table), page_only=True)


def _quantiles(known: Mapping[float, Estimate], scale: Scale) -> dict[str, Given]:
    return {share_words(q): Number(each, scale) for q, each in known.items()}


def _in_focus(found: Comparison, one: Difference, name: str) -> Section:
    """Return the quantiles and the figures of a response."""
    b, (sentence, scale) = one.design, found.responses[name]
    rows: list[dict[str, Given]] = [
        {
            "design": design.label,
            "nominal": Number(design.responses[name].nominal, scale),
            **_quantiles(design.responses[name].quantiles, scale),
        }
        for design in found.of(one)
    ]
    less = _quantiles(one.responses[name].quantiles, scale)
    rows.append({"design": f"{b} - A", **less})
    return Section(
        f"{name}, {b} and A",
        (
            blocks.paragraph(sentence, f", {scale.mark}" if scale.mark else None),
            table_of(rows, caption=_of_each(found), look="dense"),
            blocks.Gallery(tuple(figures_of(found, one, name))),
        ),
        anchor=f"{b}-{name}",
        page_only=True,
    )


def _provenance(found: Comparison) -> Section:
    rows = [
        {
            "": key.replace("_", " "),
            **{each.label: getattr(each, key) for each in found.designs},
        }
        for key in PROVENANCE
    ]
    table = table_of(rows, words=[each.label for each in found.designs])
    return Section("Provenance", (table,), page_only=True)
