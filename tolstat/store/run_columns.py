"""The columns of a run file, with what each is, and what is asked or assumed of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import h5py
import numpy as np

from tolstat.model.description import Contributor, Response
from tolstat.statistics.limits.limit import Limit
from tolstat.store.attributes import texts, write_texts
from tolstat.store.plan import Assumed

# attributes of a column
SHOWN = "shown"  # the unit in which the study writes it, or the machine declares it
LIMIT = "limit"  # least and greatest permitted value, SI
WRITTEN = "limit_as_written"
DEMANDED = "demanded_yield"  # share of machines within
TYPED_PPK = "demanded_ppk"  # where the study demands one
RANGE = "valid_range"  # what a response can never lie beyond; as netCDF has it
TOLERANCE = "tolerance"  # its ends, SI
ASSUMED = "assumed"  # its distribution, in words
AT_SCORES = "deviations_at_normal_scores"  # from -8 to 8, evenly, SI
BATCH = "batch"  # whose parts are all alike
PART = "part"  # the kind of part it belongs to
# of the status
WORDS, CODES = "words", "flag_values"


def describe(
    dataset: h5py.Dataset, what: Contributor | Response, shown: str | None
) -> None:
    """Attach unit, symbol, sentence and source to a dataset."""
    attrs = dataset.attrs
    attrs["role"] = "contributor" if isinstance(what, Contributor) else "response"
    attrs["units"], attrs["symbol"] = what.unit, what.symbol
    attrs["long_name"], attrs["source"] = what.sentence, what.source
    if shown := shown or what.shown:
        attrs[SHOWN] = shown
    if isinstance(what, Response) and what.range:
        attrs[RANGE] = what.range
    if isinstance(what, Contributor) and what.part:
        attrs[PART] = what.part


def contributor_of(dataset: h5py.Dataset) -> Contributor:
    """Read what `describe` wrote of a contributor."""
    part = dataset.attrs.get(PART, "")
    return Contributor(*_described(dataset), part=part, shown=_shown(dataset))


def response_of(dataset: h5py.Dataset) -> Response:
    """Read what `describe` wrote of a response."""
    ends = tuple(dataset.attrs[RANGE].tolist()) if RANGE in dataset.attrs else None
    return Response(*_described(dataset), shown=_shown(dataset), range=ends)


def _described(dataset: h5py.Dataset) -> tuple[str, str, str, str, str]:
    attrs, name = dataset.attrs, dataset.name.removeprefix("/")
    return name, attrs["units"], attrs["symbol"], attrs["long_name"], attrs["source"]


def _shown(dataset: h5py.Dataset) -> str:
    return str(dataset.attrs.get(SHOWN, ""))


def write_limit(dataset: h5py.Dataset, limit: Limit) -> None:
    """Attach what is asked of a response."""
    dataset.attrs[LIMIT] = limit.permitted
    dataset.attrs[WRITTEN], dataset.attrs[DEMANDED] = limit.words, limit.demanded
    if limit.typed_ppk:
        dataset.attrs[TYPED_PPK] = limit.typed_ppk


def limit_of(dataset: h5py.Dataset) -> Limit | None:
    """Read what is asked of a response; None where nothing is."""
    if LIMIT not in dataset.attrs:
        return None
    lower, upper = dataset.attrs[LIMIT].tolist()
    demanded, words = float(dataset.attrs[DEMANDED]), str(dataset.attrs[WRITTEN])
    typed = float(dataset.attrs[TYPED_PPK]) if TYPED_PPK in dataset.attrs else None
    return Limit(lower, upper, demanded, words, typed)


def write_assumed(dataset: h5py.Dataset, assumed: Assumed) -> None:
    """Attach what is assumed of a contributor."""
    attrs = dataset.attrs
    attrs[TOLERANCE], attrs[ASSUMED] = assumed.tolerance, assumed.words
    attrs["mean"], attrs["sigma"] = assumed.mean, assumed.sigma
    if assumed.batch:
        attrs[BATCH] = assumed.batch
    if assumed.at_scores:
        attrs[AT_SCORES] = assumed.at_scores


def assumed_of(dataset: h5py.Dataset) -> Assumed | None:
    """Read what is assumed of a contributor; None where it does not deviate."""
    if TOLERANCE not in dataset.attrs:
        return None
    lower, upper = dataset.attrs[TOLERANCE].tolist()
    words, batch = dataset.attrs[ASSUMED], dataset.attrs.get(BATCH, "")
    mean, sigma = (float(dataset.attrs.get(key, math.nan)) for key in ("mean", "sigma"))
    at_scores = tuple(np.asarray(dataset.attrs.get(AT_SCORES, ())).tolist())
    return Assumed((lower, upper), words, batch, mean, sigma, at_scores)


def write_words(status: h5py.Dataset, words: Mapping[int, str]) -> None:
    """Attach the words of all statuses that a trial can have."""
    status.attrs["long_name"] = "how the trial ended"
    status.attrs[CODES] = np.array(list(words), dtype=np.uint8)
    write_texts(status, WORDS, list(words.values()))
    # as the CF conventions have it, for xarray: one text, which nothing here reads
    status.attrs["flag_meanings"] = " ".join(
        word.replace(" ", "_") for word in words.values()
    )


def words_of(status: h5py.Dataset) -> dict[int, str]:
    """Read the words of all statuses that a trial can have."""
    return dict(zip(status.attrs[CODES].tolist(), texts(status, WORDS), strict=True))
