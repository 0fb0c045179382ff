"""Document of a what-if: yields, limits and responses of baseline and scenario."""

from collections.abc import Iterator, Sequence

from tolstat.answers.cells import changes, limit_cell, ppk_cell, ppm
from tolstat.answers.what_if.what_if_answer import ResponseWhatIf, WhatIf
from tolstat.document import blocks
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Word,
    counted,
    listed,
    say,
    text,
)
from tolstat.statistics.intervals.weighted_estimates import ENOUGH
from tolstat.statistics.summary import QUANTILES, Summary
from tolstat.units.scale import PER_CENT, share_words

ON_SCREEN = (0.5, 0.95)  # quantiles


def what_if_document(answer: WhatIf) -> blocks.Document:
    """Return yields, changes, limits, responses, notes."""
    both = {name: (x.baseline, x.scenario) for name, x in answer.changes.items()}
    parts = blocks.shown(
        blocks.Paragraph(_yields(answer), "lead"),
        blocks.paragraph(
            "Baseline -> scenario: ",
            changes(both),
            ". All other deviations, batches and correlations stay.",
        ),
        _limits(answer),
        _responses(answer),
        *map(blocks.note, _notes(answer)),
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
            "limit": limit_cell(limited.limit) if name else None,
            "verdict": Word(limited.yields.words, limited.yields.verdict),
            "out of limit, ppm": ppm(limited.yields.fraction_out_of_limit),
            "equivalent Ppk": ppk_cell(limited.equivalent_ppk),
            "Ppk by percentiles": ppk_cell(limited.percentiles.ppk),
            "Ppk by moments": ppk_cell(limited.moments.ppk),
        }
        for name, side, _, summary in _sides(answer, [*answer.responses])
        if (limited := summary.limited)
    ]
    page_only = ["Ppk by percentiles", "Ppk by moments"]
    return blocks.table_of(rows, "Limits", page_only=page_only, keys=2, look="verdicts")


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


def _notes(answer: WhatIf) -> Iterator[Parts]:
    """Yield the notes for readers of the numbers."""
    yield say(
        "Nothing was simulated: {}, reweighted, have an effective sample size of {}.",
        counted(answer.trials, "stored trial"),
        Number(answer.effective_sample_size),
    )
    sizes = {name: x.out_of_limit_sample_size for name, x in answer.responses.items()}
    small = [
        (Name(name), " ", Number(size))
        for name, size in sizes.items()
        if size is not None and size < ENOUGH
    ]
    if small:
        yield say(
            "Few out-of-limit trials decide these fractions; their effective sample "
            "size: {}. A fresh run tells more (`tolstat what-if ... --write "
            "STUDY.toml`).",
            listed(small),
        )
    yield from map(text, answer.notes)
    weighted = any(x.baseline.weighted for x in answer.responses.values())
    yield text(
        "Each number has its 95 % interval below it: of fractions out of limit from "
        "weighted counts, of all others for any distribution.",
        None
        if weighted
        else " Fractions and verdicts of the baseline are anytime-valid, those of the "
        "scenario for a single look. So they may differ although the trials are equal.",
    )
