"""The section of a report on one response in focus."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice

from tolstat.answers.cells import ppk_cell, ppm
from tolstat.answers.next_steps import to_draw, to_replay, to_tables, typed_setting
from tolstat.answers.report.chain_section import (
    NO_LINEAR_PART,
    chain_blocks,
    size_words,
)
from tolstat.answers.report.first_page import (
    CENTRAL,
    at_least,
    explained,
    no_cause,
    rests_on,
)
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.lots import WITHIN_LOTS, within_lots
from tolstat.answers.report.response_figures import figures_of
from tolstat.answers.report.response_summary import Cause, Causes, NamedCause
from tolstat.answers.report.summary_document import AS_SAMPLED, for_any
from tolstat.document import blocks
from tolstat.document.blocks import Block, Cell, Given, Section, Table, section
from tolstat.document.inline import Name, Number, Parts, Said, Word
from tolstat.document.sentences import counted, say, text, with_unit
from tolstat.literal import some_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity.contributions import MOST_TRIALS, Contributions
from tolstat.units.scale import AS_IS, PART, PER_CENT, PPM, Ratio, Scale, share_words

Row = dict[str, Given]
Values = Mapping[str, Estimate] | Mapping[str, float]

MOST_NAMED = 12  # of a kind of part
MOST_ROWS = 40  # contributors in a table; workbooks have all

CHOSEN = {
    "random": "at random", "near": "next to the limit", "worst": "worst",
    "spread": "over the range", "out": "at random, out of limit",
}  # fmt: skip
ALONE, TOGETHER = "alone, % of the variance", "with interactions, % of the variance"
STILL = (
    "All trials lie from {} to {}. This range is below a thousandth of its distance to "
    "the limit: its spread is not analysed."
)
FIRST_ROWS = "The first {} of {}. All: {}."
NOT_DRAWN = "Figures are drawn for the {} worst responses. To draw these: {}."
PERFORMANCE = (
    "Simulated trials show performance, not the capability of a process. By moments of "
    "random trials: as sampled."
)
REACH = (
    "For any distribution: no unit leaves the declared range of the response. Where "
    "none is declared, none lies more than twice the observed range outside."
)
LEVELS = (
    "Among out-of-limit trials: mean less that of all trials, and root mean square "
    "distance from it, both in sigmas of all trials. Level: how often chance alone "
    "makes some contributor differ so much (two rank sum tests, corrected for {} "
    "contributors and for pairs; of a kind of part its least clear member, unless it "
    "is named as a whole). Halved: the "
    "stored trials weighted by the ratio of densities; a fresh run is more precise."
)
CORRELATED = (
    "Deviations are correlated: parts correlated with a cause differ too. They are "
    "named only for what the others do not tell."
)
FEW = (
    "Few trials dominate the variance. The trials show the least joint contribution of "
    "parts, and not the contribution of each alone."
)
NEAREST = "Estimate: each trial has the error of the audited one of nearest response."
LINEAR = "Shares come from a linear regression, which explains nearly all. "
NEIGHBOURS = (
    "Shares come from nearest neighbours, which understate joint effects of parts. "
)
CLIPPED = (
    "Few trials may dominate the variance: shares are those of the response clipped to "
    "the central 99 % of its trials. "
)
FIRST_TRIALS = "Shares are those of the first {} trials. "
RARER = "They hold for trials like those seen. A rarer kind would change them."
OVERLAP = " Deviations are correlated: shares overlap and need not add up to 100 %."


def response_section(
    report: Report,
    name: str,
    page_1: Collection[tuple[str, float]] = (),
    *,
    whole: bool = False,
) -> Section:
    """Return figures, performance, main causes, contributions, errors, worst trials.

    Figures of `page_1`, by description and height, stand there alone. Of many
    contributors tables have the first ones, unless they are `whole`.
    """
    return _ResponseSection(report, name, page_1, whole=whole).section()


class _ResponseSection:
    """The parts of the section on a response."""

    def __init__(
        self,
        report: Report,
        name: str,
        page_1: Collection[tuple[str, float]],
        *,
        whole: bool,
    ) -> None:
        self.page_1, self.whole = page_1, whole
        self.report, self.name, self.run = report, name, report.stored_run
        self.response = report.responses[name]
        self.scale, shares = self.response.scale, self.response.contributions
        self.contributions = shares if shares and shares.first_order else None
        self.correlated = bool(report.assumptions.correlation)

    def section(self) -> Section:
        """Return all its parts that are not empty."""
        report, response = self.report, self.response
        values: Block = blocks.paragraph(
            Word("No trial is done"), ": there is no value to draw."
        )
        if response.still:
            ends = self._number(response.least), self._number(response.largest)
            values = blocks.paragraph(say(STILL, *ends))
        elif report.trials.done and self.name in report.illustrated:
            figures = figures_of(report, self.name)
            values = blocks.Gallery(tuple(
                f for f in figures if (f.alt, f.picture.height) not in self.page_1
            ))  # fmt: skip
        elif report.trials.done:
            draw = to_draw(self.run, self.name)
            values = blocks.paragraph(
                say(NOT_DRAWN, Number(len(report.illustrated)), draw)
            )
        parts = (
            ("Performance", self._performance()),
            ("Mean and sigma", self._kinds_of_interval()),
            ("Main causes of out-of-limit trials", self._causes()),
            ("Variance contributions", self._contributions()),
            ("Requested quantiles", self._requested()),
            ("Chain", chain_blocks(report, self.name)),
            ("Classical answers", (self._classical(),)),
            ("Integration error", self._integration()),
            ("Worst trials", (self._worst_trials(),)),
        )
        return section(
            self.name,
            blocks.note(self._declared()),
            blocks.paragraph(self._point_mass()),
            values,
            *(section(title, *part) for title, part in parts),
            anchor=self.name,
        )

    def _number(self, value: Estimate | float) -> Number:
        return Number(value, self.scale)

    def _table(
        self, rows: Iterable[Row], look: str = "", words: Sequence[str] = ()
    ) -> Table:
        caption = rests_on(self.report)
        return blocks.table_of(rows, words=words, caption=caption, look=look)

    def _first_rows(
        self,
        rows: Iterator[Row],
        number: int,
        look: str = "",
        words: Sequence[str] = (),
    ) -> tuple[Block, ...]:
        """Return a table of so many rows, or of the first of them."""
        if self.whole or number <= MOST_ROWS:
            return (self._table(rows, look, words),)
        note = say(
            FIRST_ROWS, str(MOST_ROWS), str(number), to_tables(self.run, self.name)
        )
        return self._table(islice(rows, MOST_ROWS), look, words), blocks.note(note)

    def _declared(self) -> Parts:
        response = self.response
        source = f"equation {response.source}" if response.source else ""
        facts = ", ".join(filter(None, (response.sentence, response.symbol, source)))
        return text(f"{facts}." if facts else None)

    def _point_mass(self) -> Parts:
        """Return a sentence on the value that many trials share."""
        if (mass := self.response.point_mass) is None:
            return ()
        ends = self._number(mass.least), self._number(mass.largest)
        return say(
            "{} of production shares one value, {}{}. The histogram shows the others.",
            Number(mass.share, PER_CENT, of=self.report.trials.done),
            self._number(mass.value),
            say(" (from {} to {})", *ends) if mass.least != mass.largest else None,
        )  # fmt: skip

    def _performance(self) -> tuple[Block, ...]:
        if (limited := self.response.limited) is None:
            return ()
        head = f"against {limited.limit.words}"
        equivalent = None, Number(limited.equivalent_ppk)
        methods: dict[str, Iterable[Given]] = {
            "equivalent, of the fraction out of limit": equivalent,
            "by percentiles (ISO 22514-2)": map(ppk_cell, limited.percentiles),
            "by moments, as for normal responses": map(ppk_cell, limited.moments),
        }
        names = [part.name for part in self.run.contributors]
        if within := within_lots(limited.moments, self.response.contributions, names):
            methods[WITHIN_LOTS] = map(ppk_cell, within)
        rows = ({head: n, "Pp": pp, "Ppk": ppk} for n, (pp, ppk) in methods.items())
        return self._table(rows), blocks.note(PERFORMANCE)

    def _kinds_of_interval(self) -> tuple[Block, ...]:
        """Return mean and sigma with either kind of interval."""
        response, wide = self.response, for_any(self.response)
        rows: list[Row] = [
            {
                "interval": "as sampled",
                "mean": None if "mean" in wide else self._number(response.mean),
                "sigma": None if "sigma" in wide else self._number(response.sigma),
            },
            {
                "interval": "for any distribution",
                "mean": self._number(response.mean_for_any_distribution),
                "sigma": self._number(response.sigma_for_any_distribution),
            },
        ]
        return self._table(rows), blocks.note(f"{AS_SAMPLED} {REACH}")

    def _causes(self) -> tuple[Block | None, ...]:
        if (causes := self.response.causes) is None or self.response.still:
            return ()
        out, tested = causes.trials_out_of_limit, len(causes.contributors)
        failed = ", failed ones among them" if self.report.trials.failed else None
        finding = self.report.findings.limits[self.name]
        none = None if causes.named else f": {no_cause(finding)}"
        kind = "random trial" if self.report.stored_run.thinned else "trial"
        return (
            blocks.paragraph(counted(out, kind), " out of limit", failed, none, "."),
            *(self._causes_table(causes) if out else ()),
            blocks.note(say(LEVELS, str(tested))) if out and tested else None,
            blocks.note(CORRELATED) if self.correlated and tested else None,
        )

    def _causes_table(self, causes: Causes) -> tuple[Block, ...]:
        """Return a table of what is named together, each kind of part, contributor."""
        together = [x for x in causes.named if x.words not in causes.contributors]
        number = len(together) + len(causes.by_name)
        rows = _rows_of_causes(causes, together)
        return self._first_rows(rows, number, words=["contributor"])

    def _contributions(self) -> tuple[Block | None, ...]:
        response, shares = self.response, self.contributions
        names = [*response.leading, *response.slopes]  # what matters first
        for case in response.worst_cases.values():
            names += [name for name, deviation in case.deviations.items() if deviation]
        names += response.indices.first if response.indices else ()
        if response.still or not names:
            return ()
        kinds = self._kinds(shares) if shares else []
        contributors = dict.fromkeys(names)
        rows = chain(kinds, self._contributors(contributors))
        return (
            blocks.paragraph(FEW) if shares and shares.dominated_by_few else None,
            blocks.paragraph(self._indices()),
            *self._first_rows(rows, len(kinds) + len(contributors), "dense"),
            blocks.note(self._remarks(shares)) if shares else None,
        )

    def _indices(self) -> Parts:
        """Return the trials behind Sobol' indices, or why there are none."""
        if (indices := self.response.indices) is None:
            return ()
        why = "Sobol' indices of"
        if indices.reason:
            why = f"No Sobol' indices: {indices.reason}; there are"
        broken = f"({indices.broken} left out: not all of their trials are done)."
        groups = counted(indices.groups, "group")
        return text(why, " ", groups, f" of trials {broken}")

    def _kinds(self, shares: Contributions) -> list[Row]:
        """Return a row for each kind of part, the largest share first."""
        rows: list[Row] = []
        size = {n: x.value for n, x in self.response.shares_of_kinds.items()}
        for kind in sorted(size, key=lambda n: -size[n] if size[n] == size[n] else 0.0):
            together, members = shares.together[kind], self.response.members[kind]
            share: Given = Number(together, PART)
            alone: Given = Cell((Number(shares.groups[kind], PART),),
                                text("sum of first orders"))  # fmt: skip
            if shares.dominated_by_few:
                reason = Cell((), text(f"{together.reason}"))
                share, alone = at_least(together) if together.sure else reason, None
            rows.append({
                "contributor": Cell((Name(kind),), text(some_of(members, MOST_NAMED))),
                ALONE + CENTRAL * shares.clipped: alone,
                TOGETHER + CENTRAL * shares.clipped: share,
            })  # fmt: skip
        return rows

    def _contributors(self, names: Iterable[str]) -> Iterator[Row]:
        """Yield a row for each contributor."""
        response, shares = self.response, dict[str, tuple[Values, Scale | Ratio]]()
        if analysed := self.contributions:
            alone = {} if analysed.dominated_by_few else analysed.first_order
            shares[ALONE + CENTRAL * analysed.clipped] = alone, PART
            shares["rank regression coefficient"] = analysed.rank_regression, AS_IS
        if (indices := response.indices) and not indices.reason:
            central = CENTRAL * indices.clipped
            shares[f"Sobol' first-order index, %{central}"] = indices.first, PART
            shares[f"Sobol' total index, %{central}"] = indices.total, PART
        if linear := response.root_sum_square:
            shares["root sum square, % of the variance"] = linear.shares, PART
        worst = {
            f"worst case, {side}": case.deviations
            for side, case in response.worst_cases.items()
        }
        for part in names:
            scale = self.run.scales.get(part, AS_IS)  # a batch has none
            row: Row = {"contributor": Name(part)}
            for head, (values, unit) in shares.items():
                if part in values:
                    row[head] = Number(values[part], unit)
            if part in response.slopes:
                slope = Number(response.slopes[part], Ratio(self.scale, scale))
                row["slope at the nominal trial"] = with_unit(slope)
            for head, deviations in worst.items():
                if part in deviations:
                    row[head] = with_unit(Number(deviations[part], scale))
            yield row

    def _remarks(self, shares: Contributions) -> Parts:
        rest = "interaction" if shares.linear else "interaction, correlation or chance"
        nan = math.isnan(shares.unexplained.value)
        estimated = not shares.dominated_by_few and not nan
        alone = say(f"Not explained by contributors alone: {{}} ({rest}). ",
                    Number(shares.unexplained, PART))  # fmt: skip
        ranks = say("Ranks explain {}. ", Number(shares.explained, PART))
        chance = estimated and not shares.linear
        some = shares.trials == MOST_TRIALS < self.report.trials.done
        return text(
            alone if estimated else None,
            None if math.isnan(shares.explained.value) else ranks,
            say(FIRST_TRIALS, Number(shares.trials)) if some else None,
            CLIPPED if shares.clipped else None,
            LINEAR if shares.linear else NEIGHBOURS,
            "Estimates below 0 are chance. " if chance else None,
            RARER,
            OVERLAP if self.correlated else None,
        )

    def _requested(self) -> tuple[Block, ...]:
        if (requested := self.response.requested) is None:
            return ()
        head, quantiles = self.scale.label(self.name), requested.quantiles
        rows: list[Row] = [
            {"quantile": share_words(share), head: self._number(x)}
            for share, x in quantiles.items()
        ]
        least, largest = requested.shortest
        between = self._number(least), self._number(largest)
        words = say(
            f"The shortest interval with {share_words(requested.share)} of the trials: "
            "{} to {}.", *between,
        )  # fmt: skip
        return self._table(rows), blocks.paragraph(() if math.isnan(least) else words)

    def _classical(self) -> Table | None:
        response, rows = self.response, dict[str, tuple[Given, Said]]()
        if response.still:
            return None
        for side, case in response.worst_cases.items():
            note = "no probability: the worst within the tolerances, by the model"
            if case.tried:
                note = f"no probability: the worst of {case.tried} trials within them"
            if case.failed:
                note += f"; {case.failed} of these failed, and count as out of limit"
            rows[f"worst case, {side}"] = self._number(case.value), note
        if linear := response.root_sum_square:
            sigma = say("sigma {}", self._number(linear.sigma))
            mean = Cell((self._number(linear.mean),), sigma)
            basis = "slopes at the nominal trial, normal response"
            rows["root sum square"] = mean, basis
        elif response.no_linear_part:
            rows["root sum square"] = "", NO_LINEAR_PART
        for departure in response.departures:
            wrong = "little" if departure.relative > 0 else "much"
            fails = Word("root sum square fails"), f" (it promises too {wrong}): "
            simulated = self._number(response.quantiles[departure.share])
            rows[f"{share_words(departure.share)}: root sum square"] = (
                self._number(departure.linear),
                (fails if departure.fails else None, "simulated ", simulated),
            )
        head = self.scale.label(self.name)
        return self._table(
            ({"answer": answer, head: value, "": text(note)}
             for answer, (value, note) in rows.items()), words=[""],
        )  # fmt: skip

    def _integration(self) -> tuple[Block | None, ...]:
        """Return the size of integration errors, and their effect."""
        if (errors := self.response.integration_errors) is None:
            return ()
        exact, effect = self.scale._replace(least=0.0), errors.effect
        settings = errors.settings.items()
        typed = (f"{n} {typed_setting(self.run, n, x)}" for n, x in settings)
        tightened = ", ".join(typed).replace('"', "")
        above = text("Trials depend on each other: how many err more is not known.")
        if errors.above == errors.above:
            above = say(
                "At most {} of production err more (95 %) than the largest at random.",
                Number(errors.above, PER_CENT, "at_most"),
            )
        sizes: list[Row] = [
            {"chosen": CHOSEN[why], "trials": Number(largest.trials),
             exact.label("largest error"): Number(largest.largest, exact)}
            for why, largest in {"random": errors.at_random, **errors.chosen}.items()
            if largest.trials
        ]  # fmt: skip
        moved: Row = {}
        if effect:
            numbers = {n: Number(x, exact) for n, x in effect.numbers.items()}
            moved = {"unit": exact.mark, **numbers}
            if effect.fraction_out_of_limit is not None:
                moved["out of limit, ppm"] = Number(effect.fraction_out_of_limit, PPM)
        sides: Parts = ()
        if errors.changed is not None:
            changed = Number(errors.changed)
            sides = text("Trials that change sides of the limit: ", changed, ".")
        return (
            blocks.paragraph(say(
                f"{{}} evaluated again with {tightened} ({errors.failed} failed one of "
                "the two times). The largest error is no bound for others. {}",
                counted(errors.trials, "trial"),
                above if errors.at_random.trials else None,
            )),
            self._table(sizes),
            self._table([moved]) if moved else None,
            blocks.note(NEAREST) if moved else None,
            blocks.paragraph(sides),
        )  # fmt: skip

    def _worst_trials(self) -> Table:
        again, run, trials = "to see it again", self.run, self.report.trials
        rows: list[Row] = []
        sized = {part.name: part for part in run.contributors if part.size is not None}
        for worst in self.response.worst_trials:
            deviations = worst.deviations.items()
            precise = worst.precise
            rows.append({
                "trial": Number(worst.trial),
                self.scale.label(self.name): self._number(worst.value),
                "evaluated again": None if math.isnan(precise)
                else self._number(precise),
                **{n: size_words(run, sized[n], x) if n in sized
                   else with_unit(Number(x, run.scales[n])) for n, x in deviations},
                again: to_replay(run.path, worst.trial, run.machine),
            })  # fmt: skip
        caption = rests_on(self.report)
        if trials.counted < trials.ran:  # these are the worst of all
            done = Number(trials.by_status["done"])
            caption = say("of all {} trials done", done)
        return blocks.table_of(rows, words=[again], caption=caption)


def _rows_of_causes(causes: Causes, together: Sequence[NamedCause]) -> Iterator[Row]:
    """Yield a row for what is named together, then for each kind of part and part."""
    for named in together:
        below: Parts = ()
        if pair := named.together:
            alone = Number(pair.alone, PER_CENT, "at_most")
            below = say("{}; any of them alone in at most {}",
                        explained(pair, causes), alone)  # fmt: skip
        yield _cause(Cell((Word(named.words),), below), named)
    for name, cause in sorted(causes.by_name.items(), key=_clearest_first):
        single = cause.shift == cause.shift
        part = Word(name) if cause.significant else Name(name)
        yield {
            **_cause(Cell((part,)), cause),
            "mean, sigmas": Number(cause.shift) if single else None,
            "distance, sigmas": Number(cause.width) if single else None,
        }


def _cause(part: Cell, cause: Cause | NamedCause) -> Row:
    size = cause.effective_sample_size
    return {
        "contributor": part,
        "level, %": Number(cause.level, PART),
        "out of limit with its tolerance halved, ppm": ppm(cause.halved),
        "effective sample size": Number(size) if size else None,
    }


def _clearest_first(named: tuple[str, Cause]) -> tuple[float, float]:
    """Sort by how clearly it differs, then by what halving leaves out of limit."""
    cause, after = named[1], named[1].halved.value
    return cause.level, math.inf if math.isnan(after) else after
