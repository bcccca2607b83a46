# SPDX-License-Identifier: BSD-3-Clause
"""`njit` with a cache on disk that follows the whole plant (golden_model/kernel.py).

Code elsewhere that compiles the plant's kernels into its own and caches the result must include `SOURCE_HASH` in its
key.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

from golden_model.kernel import CACHE_DIR as OF_THE_MODEL
from golden_model.kernel import Kernel, kernel, source_hash

P = ParamSpec("P")
R_co = TypeVar("R_co", covariant=True)

SOURCE_HASH = source_hash(Path(__file__).resolve().parent)
CACHE_DIR = OF_THE_MODEL.parent / SOURCE_HASH


def njit(function: Callable[P, R_co]) -> Kernel[P, R_co]:
    """Compile a function with numba on first call and keep the result on disk."""
    return kernel(function, CACHE_DIR)
