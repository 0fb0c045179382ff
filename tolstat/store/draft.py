"""A run file but for its rows, made in memory: all that HDF5 ever writes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py

from tolstat.store.audited import write_audited
from tolstat.store.layout import AUDIT, EVIDENCE, RERUN, SEAL, lay_out
from tolstat.store.memory_file import MemoryFile
from tolstat.store.metadata import (
    write_facts,
    write_numbers,
    write_reference,
    write_settings,
)
from tolstat.store.plan import Ending, Plan
from tolstat.store.seal import write_seal
from tolstat.store.stored_diagnostics import write_evidence
from tolstat.store.trial_rows import Place, places_of

ALIGNED = 64  # bytes: no value lies across two pages, where a kill could tear it


def draft_of(
    plan: Plan, facts: Mapping[str, Any], path: Path, trials: int, ending: Ending | None
) -> tuple[MemoryFile, dict[str, Place]]:
    """Make all of a file but its rows, and seal it.

    The ending is None before the end. Returned with the file is where its rows go.
    """
    draft = MemoryFile()
    with h5py.File(
        draft, "w", alignment_threshold=1, alignment_interval=ALIGNED
    ) as file:
        write_facts(file, plan, path, ending.stopped if ending else None)
        for name, fact in facts.items():
            file.attrs[name] = fact
        lay_out(file, plan, trials)
        write_settings(file, plan.settings)
        write_numbers(file, plan.numbers)
        write_reference(file, plan.reference)
        if ending:
            responses = plan.description.responses
            for name, audited in ((AUDIT, ending.audited), (RERUN, ending.rerun)):
                if audited:
                    write_audited(file.create_group(name), audited, responses)
            write_evidence(file.create_group(EVIDENCE), ending.evidence)
        places, seal = places_of(file), file[SEAL]
        where, length = seal.id.get_offset(), seal.dtype.itemsize
    write_seal(draft, where, length, [each.hole for each in places.values()])
    return draft, places
