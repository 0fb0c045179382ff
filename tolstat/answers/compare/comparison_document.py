"""Document of a comparison: significant differences, each design less A; figures."""

from collections.abc import Iterator, Mapping
from itertools import chain

import numpy as np

from tolstat.answers.cells import changes, limit_row, numbers_of, ppk_cell, ppm
from tolstat.answers.compare.comparison import Comparison, Design, Difference
from tolstat.answers.compare.pairing import Pairing
from tolstat.answers.report.finding_words import sentences
from tolstat.answers.report.response_figures import (
    PROBABILITY,
    STRAIGHT,
    edges_of,
    figure_of,
    limit_rules,
    line_at,
    paired_figure,
    points_of,
)
from tolstat.document import blocks
from tolstat.document.blocks import Cell, Given, Section, Table, note, table_of
from tolstat.document.inline import Name, Number, Parts
from tolstat.document.plot import Histogram, PlotAxis
from tolstat.document.sentences import counted, listed, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import PER_CENT, Scale, share_words

Row = dict[str, Given]

CHANGES = {
    "fewer": "significantly fewer trials out of the limit of ",
    "more": "significantly more trials out of the limit of ",
    "neither": "no significant difference in trials out of the limit of ",
    "higher_ppk": "significantly higher Ppk by moments of ",
    "lower_ppk": "significantly lower Ppk by moments of ",
}
EQUAL = 1e-9  # of differences: all trials moved alike
PROVENANCE = ("run", "model", "started_at", "source_digest", "version_tolstat")


def comparison_document(comparison: Comparison) -> blocks.Document:
    """Return the document of a comparison."""
    designs = comparison.designs
    facts = tuple(
        (run.label, say("{} ({}): {}", run.title, run.run, _trials(run)))
        for run in designs
    )
    warnings = tuple(
        text(f"{design.label}: ", *parts)
        for design in designs
        for parts in sentences(design.warnings)
    )
    pairs = (_Pair(comparison, less) for less in comparison.differences)
    rows: list[Row] = [
        {"": key.replace("_", " "), **{run.label: getattr(run, key) for run in designs}}
        for key in PROVENANCE
    ]
    table = table_of(rows, words=[run.label for run in designs])
    return blocks.Document(
        " | ".join(run.title for run in designs),
        blocks.shown(
            blocks.section(
                "", blocks.Bullets(warnings), _lead(comparison), blocks.Facts(facts)
            ),
            _verdicts(comparison),
            *chain.from_iterable(pair.sections() for pair in pairs),
            blocks.section("Provenance", table, page_only=True),
        ),
        tuple(run.run for run in designs),
    )


def _trials(design: Design) -> Parts:
    done = counted(design.done, "trial")
    return say("{} done, {} failed", done, Number(design.failed))


def _trials_of_all(comparison: Comparison) -> Parts:
    """Say how many trials the numbers of each design rest on."""
    return _joined([text(f"{x.label}: ", _trials(x)) for x in comparison.designs])


def _joined(clauses: list[Parts]) -> Parts:
    return text(*(text("; ", x) if i else x for i, x in enumerate(clauses)))


def _lead(comparison: Comparison) -> blocks.Block:
    """Return the limits on which designs differ significantly."""
    bullets = []
    for difference in comparison.differences:
        groups = [
            text(words, listed([*map(Name, names)]))
            for change, words in CHANGES.items()
            if (names := getattr(difference.findings, change))
        ]
        if groups:
            bullets.append(text(f"{difference.design} less A: ", _joined(groups), "."))
    if bullets:
        return blocks.Bullets(tuple(bullets))
    return blocks.Paragraph(text("No study limits a response."), "lead")


def _verdicts(comparison: Comparison) -> Section:
    rows: list[Row] = [
        {
            "response": text(Name(name), f" {design.label}"),
            **limit_row(limited, design.done + design.failed, design.failed),
        }
        for name in comparison.responses
        for design in comparison.designs
        if (response := design.responses.get(name)) and (limited := response.limited)
    ]
    caption = _trials_of_all(comparison)
    table = table_of(rows, "Verdicts", caption=caption, look="verdicts")
    return blocks.section("", table, page_only=True)


def _quantiles(quantiles: Mapping[float, Estimate], scale: Scale) -> Row:
    return {share_words(q): Number(x, scale) for q, x in quantiles.items()}


class _Pair:
    """The sections about a design, B, less the first."""

    def __init__(self, comparison: Comparison, difference: Difference) -> None:
        self.difference, self.pairing = difference, difference.pairing
        self.designs = comparison.designs_of(difference)
        self.described = comparison.responses
        self.b, self.trials_of_all = difference.design, _trials_of_all(comparison)

    def sections(self) -> Iterator[Section]:
        """Yield the numbers of all responses, then those in focus."""
        differ = (
            ("Settings", self.difference.settings),
            ("Deviations", self.difference.deviations),
        )
        notes = [
            note(f"{head} that differ: ", changes(differing), ".")
            for head, differing in differ
            if differing
        ]
        yield blocks.section(
            f"{self.b} less A", note(self._how_paired()), *notes, self._limits(),
            self._responses(), self._trial_by_trial(), self._reading(),
        )  # fmt: skip
        yield from map(self._in_focus, self.difference.focus)

    def _caption(self) -> Parts:
        """Say how many trials the numbers of the difference rest on."""
        if not self.pairing.paired:
            return text("unpaired; ", self.trials_of_all)
        done = counted(self.pairing.done_in_both, "trial")
        failed = Number(self.pairing.failed)
        return say("{} done in A and in {}, {} failed in either", done, self.b, failed)

    def _how_paired(self) -> Parts:
        how = self.pairing
        kind = f"{how.kind} ({how.words})"
        if not how.paired:
            return text(
                f"{kind}; not trial by trial: differences of means, quantiles and "
                "fractions."
            )
        trials = counted(how.trials, "trial")
        done = Number(how.done_in_both)
        return say(f"{kind}. {{}} of {{}} are done in both.", done, trials)

    def _reading(self) -> blocks.Paragraph:
        """Return the note for readers of the tables."""
        return note(
            f"Each number has its 95 % interval below it: {self.pairing.promise}. ",
            "A design without a limit is judged by that of the other. ",
            f"Worse: trials within in A and out of limit in {self.b}; better: the "
            "other way round. " if self.pairing.paired else None,
            "The interval of a mean assumes that no difference lies farther out than "
            "twice the spread of these.",
        )  # fmt: skip

    def _limits(self) -> Table:
        b, rows = self.b, list[Row]()
        by_moments = f"Ppk by moments: {b} - A"
        both = self.pairing.done_in_both + self.pairing.failed
        ran = tuple(both or design.done + design.failed for design in self.designs)
        of_report = "; ppm and Ppk: trials that the report of each design judges by"
        limits, caption = self.difference.limits, self._caption()
        if any(limit.trials != ran for limit in limits.values()):
            caption = text(caption, of_report)
        for name, limit in limits.items():
            first, second = limit.limits
            other = text(f"{b}: {second}") if second != first else ()
            ppms = map(ppm, limit.fractions_out_of_limit, limit.trials)
            ppks = map(ppk_cell, limit.equivalent_ppks)
            rows.append({
                "response": Name(name),
                "limit": Cell(text(first), other),
                **dict(zip(("ppm: A", f"ppm: {b}"), ppms, strict=True)),
                f"ppm: {b} - A": ppm(limit.fraction_out_of_limit_difference),
                "worse": None if limit.worse is None else Number(limit.worse),
                "better": None if limit.better is None else Number(limit.better),
                **dict(zip(("Ppk: A", f"Ppk: {b}"), ppks, strict=True)),
                f"Ppk: {b} - A": ppk_cell(limit.equivalent_ppk_difference),
                by_moments: ppk_cell(limit.moments_ppk_difference),
            })  # fmt: skip
        return table_of(
            rows, "Out of limit, and equivalent Ppk", page_only=[by_moments],
            caption=caption, look="dense",
        )  # fmt: skip

    def _responses(self) -> Table:
        b, share, rows = self.b, share_words(0.95), list[Row]()
        less, larger = f"{b} - A", f"larger in {b}, %"
        for name, response in self.difference.responses.items():
            scale, both = self.described[name].scale, self.pairing.done_in_both
            row: Row = {"response": Name(name), "unit": scale.mark}
            for design in self.designs:
                quantile = design.responses[name].quantiles[0.95]
                row[f"{design.label}: {share}"] = Number(quantile, scale)
            row[f"{less}: mean"] = Number(response.mean, scale)
            for q, quantile in response.quantiles.items():
                row[f"{less}: {share_words(q)}"] = Number(quantile, scale)
            if self.pairing.paired:
                row[f"smaller in {b}, %"] = Number(response.smaller, PER_CENT, of=both)
                row[larger] = Number(response.larger, PER_CENT, of=both)
            rows.append(row)
        caption = say(
            f"{{}}. Differences: {{}}. {less}: of quantiles, their difference",
            self.trials_of_all, self._caption(),
        )  # fmt: skip
        return table_of(
            rows, "Responses", page_only=[f"{less}: mean", larger], caption=caption,
            keys=2, look="dense",
        )  # fmt: skip

    def _trial_by_trial(self) -> Section:
        rows: list[Row] = []
        for name, response in self.difference.responses.items():
            if summary := response.trial_by_trial:
                scale = self.described[name].scale
                numbers = numbers_of(summary, scale)
                del numbers["sigma"]
                rows.append({"response": Name(name), "unit": scale.mark, **numbers})
        table = table_of(
            rows, "Differences trial by trial", caption=self._caption(), keys=2,
            look="dense",
        )  # fmt: skip
        return blocks.section("", table, page_only=True)

    def _in_focus(self, name: str) -> Section:
        """Return the quantiles and the figures of a response."""
        sentence, scale = self.described[name]
        rows: list[Row] = [
            {
                "design": design.label,
                "nominal": Number(response.nominal, scale),
                **_quantiles(response.quantiles, scale),
            }
            for design in self.designs
            for response in [design.responses[name]]
        ]
        less = _quantiles(self.difference.responses[name].quantiles, scale)
        rows.append({"design": f"{self.b} - A", **less})
        figures = _figures_of(self.pairing, self.designs, name, scale)
        return blocks.section(
            f"{name}, {self.b} and A",
            blocks.paragraph(sentence, f", {scale.mark}" if scale.mark else None),
            table_of(rows, caption=self.trials_of_all, look="dense"),
            blocks.Gallery(tuple(figures)),
            anchor=f"{self.b}-{name}",
            page_only=True,
        )


def _figures_of(
    pairing: Pairing, designs: tuple[Design, Design], name: str, scale: Scale
) -> Iterator[blocks.Figure]:
    """Draw a response in focus: its distributions and, if paired, differences."""
    if any(drawn.sample.weights for drawn in (pairing.first, pairing.second)):
        return  # weighted trials are not spread as units are
    a, b = (design.responses[name] for design in designs)
    label, times = designs[1].label, scale.factor
    first, second = pairing.done(name)
    whose = f"All trials done: {len(first)} of A, {len(second)} of {label}."
    if pairing.paired:
        failed = f"{pairing.failed} failed in either"
        whose = f"The {len(first)} that are done in both; {failed}."
    yield figure_of(
        f"Distributions of {name} in A and in {label}",
        PlotAxis(scale.label(name)),
        PROBABILITY,
        points_of(first, times, "first", "A"),
        points_of(second, times, "second", label),
        *limit_rules(a if a.limited else b, scale),
        caption=f"Fraction below. {STRAIGHT} {whose}",
    )
    if not pairing.paired:
        return
    less = times * (second - first)
    if np.ptp(less) > EQUAL * np.abs(less).max():  # else the table has all of it
        counts, edges = np.histogram(less, edges_of(less))
        yield figure_of(
            f"Histogram of the differences of {name}, {label} less A",
            PlotAxis(scale.label(f"{label} - A of {name}")),
            PlotAxis("trials per bin", "symlog", (0.0, 1.5 * float(counts.max()))),
            Histogram(edges, counts.astype(float), "third"),
            line_at(0.0, "no difference", "ink", "-"),
            caption="Differences trial by trial, of those that are done in both.",
        )
    yield paired_figure(
        name, scale, ("A", label), (first, second),
        tuple(response.limited for response in (a, b)),
    )  # fmt: skip
