"""What the compiler is told: processor and level, which users may change."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

# LLVM's third level does not make equations faster, and takes a tenth longer
LEVEL = 2


@contextmanager
def settings_of_numba(folder: str | None = None) -> Iterator[None]:
    """Give Numba our level and a folder for its cache; restored, as they are global."""
    from numba import config

    before = config.CACHE_DIR, config.OPT
    try:
        config.CACHE_DIR = folder or before[0]
        config.OPT = min(type(before[1])(LEVEL), before[1])  # a type of Numba
        yield
    finally:
        config.CACHE_DIR, config.OPT = before


@cache
def machine_code() -> str:
    """Return what identifies compiled code, beside source and version of Numba."""
    from llvmlite import binding
    from numba import config
    from numba.core.registry import cpu_target

    if config.DISABLE_JIT:
        return "none: NUMBA_DISABLE_JIT is set"
    with settings_of_numba():
        level = int(config.OPT)
        target, cpu, features = cpu_target.target_context.codegen().magic_tuple()
    options = f"{features} {config.LOOP_VECTORIZE} {config.SLP_VECTORIZE}"
    digest = hashlib.sha256(options.encode()).hexdigest()[:8]
    llvm = ".".join(map(str, binding.llvm_version_info))
    return f"{target} {cpu}, features {digest}, level {level}, LLVM {llvm}"
