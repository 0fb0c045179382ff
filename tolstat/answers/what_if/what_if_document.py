"""Document of a what-if: yields, limits and responses of baseline and scenario."""

from collections.abc import Iterator, Sequence

from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm
from tolstat.answers.what_if.scenarios_document import figures_of, notes_of
from tolstat.answers.what_if.what_if_answer import ResponseWhatIf, WhatIf
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import say, text, with_unit
from tolstat.statistics.summary import QUANTILES, Summary
from tolstat.units.scale import PER_CENT, share_words

ON_SCREEN = (0.5, 0.95)  # quantiles


def what_if_document(answer: WhatIf) -> blocks.Document:
    """Return yields, changes, limits, responses, notes."""
    both = {name: (x.baseline, x.scenario) for name, x in answer.changes.items()}
    both |= {
        name: (before.limit.words if before else "", after.limit.words)
        for name, x in answer.responses.items()
        if (after := x.scenario.limited)
        and ((before := x.baseline.limited) is None or before.limit != after.limit)
    }
    parts = blocks.shown(
        blocks.Paragraph(_yields(answer), "lead"),
        blocks.paragraph(
            "Baseline -> scenario: ",
            changes(both),
            ". All other deviations, batches and correlations stay.",
        ),
        _limits(answer),
        _differences(answer),
        _responses(answer),
        figures_of([answer]),
        *map(blocks.note, notes_of(answer)),
    )
    return blocks.Document(
        f"{answer.title}: what if", parts, (answer.run, answer.model)
    )


def _yields(answer: WhatIf) -> Parts:
    both = answer.all_limits
    if both is None:
        return text("The study limits no response.")
    whose = "all limits" if both.baseline.limits > 1 else "this limit"
    yields = (Number(side.within, PER_CENT) for side in both)
    return say("Yield, {}: {} -> {}.", whose, *yields)


def _sides(
    answer: WhatIf, names: Sequence[str]
) -> Iterator[tuple[Name | None, str, ResponseWhatIf, Summary]]:
    """Yield baseline and scenario of responses; only the first one is named."""
    for name in names:
        response = answer.responses[name]
        yield Name(name), "baseline", response, response.baseline
        yield None, "scenario", response, response.scenario


def _limits(answer: WhatIf) -> blocks.Table:
    rows = [
        {
            "response": name,
            "": side,
            "limit": limit_cell(limited.limit) if name or moved else None,
            "verdict": Word(limited.yields.words, limited.yields.verdict),
            "out of limit, ppm": ppm(limited.yields.fraction_out_of_limit),
            "equivalent Ppk": ppk_cell(limited.equivalent_ppk),
            "Ppk by percentiles": ppk_cell(limited.percentiles.ppk),
            "Ppk by moments": ppk_cell(limited.moments.ppk),
        }
        for name, side, other, summary in _sides(answer, [*answer.responses])
        if (limited := summary.limited)
        for moved in [limited.limit != getattr(other.baseline.limited, "limit", None)]
    ]
    page_only = ["Ppk by percentiles", "Ppk by moments"]
    return blocks.table_of(rows, "Limits", page_only=page_only, keys=2, look="verdicts")


def _differences(answer: WhatIf) -> blocks.Table | None:
    """Return the paired differences of limits; None of trials not evaluated."""
    rows: list[dict[str, blocks.Given]] = []
    for name, response in answer.responses.items():
        less = response.difference
        if less is None or (limit := less.limit) is None:
            continue
        rows.append({
            "response": Name(name),
            "out of limit, ppm": ppm(limit.fraction_out_of_limit_difference),
            "worse": None if limit.worse is None else Number(limit.worse),
            "better": None if limit.better is None else Number(limit.better),
            "equivalent Ppk": ppk_cell(limit.equivalent_ppk_difference),
            "mean": with_unit(Number(less.mean, response.scale)),
        })  # fmt: skip
    if not rows:
        return None
    return blocks.table_of(rows, "Scenario less baseline", look="dense")


def _responses(answer: WhatIf) -> blocks.Table:
    """Return the statistics of all responses, those with limits first."""
    limited = [name for name, x in answer.responses.items() if x.scenario.limited]
    names = [*dict.fromkeys([*limited, *answer.responses])]
    rows = [
        {
            "response": name,
            "unit": response.scale.mark if name else None,
            "": side,
            "nominal": Number(response.nominal, response.scale) if name else None,
            "mean": Number(summary.mean_for_any_distribution, response.scale),
            "sigma": Number(summary.sigma_for_any_distribution, response.scale),
            **{
                share_words(share): Number(summary.quantiles[share], response.scale)
                for share in QUANTILES
            },
        }
        for name, side, response, summary in _sides(answer, names)
    ]
    others = [share_words(share) for share in QUANTILES if share not in ON_SCREEN]
    page_only = ["nominal", "mean", "sigma", *others]
    return blocks.table_of(rows, "Responses", page_only=page_only, keys=3, look="dense")
