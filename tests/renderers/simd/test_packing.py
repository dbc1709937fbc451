import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba import njit

from renderers.simd import load, store_packed


@njit
def _packed(x: Any, out: Any, limit: Any) -> None:
    v = load(x, 0, 16)
    store_packed(out, 2, v, v > limit)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
@pytest.mark.parametrize("limit", [-20, 0, 3, 20])
def test_chosen_lanes_are_packed_and_nothing_else_is_touched(
    dtype: Any, limit: int
) -> None:
    x = np.random.default_rng(1).integers(-10, 10, 16).astype(dtype)
    chosen = x[x > limit]
    out = np.full(3 + len(chosen), 77, dtype)
    _packed(x, out, dtype(limit))
    np.testing.assert_array_equal(out, [77, 77, *chosen, 77])


PACK = """
import numpy as np
from numba import njit
from renderers.simd import bits, load, store_packed

@njit
def pack(x, keep, out):
    met = load(keep, 0, 16) != np.int32(0)
    store_packed(out, 1, load(x, 0, 16), met)
    return bits(met)

rng = np.random.default_rng(2)
for dtype in (np.float32, np.int32):
    x = np.arange(16).astype(dtype)
    for low in range(256):
        keep = ((low | int(rng.integers(256)) << 8) >> np.arange(16) & 1).astype("i4")
        out = np.full(18, -1, dtype)
        assert pack(x, keep, out) & 255 == low
        chosen = x[keep != 0]
        wanted = [-1, *chosen, *[-1] * (17 - len(chosen))]
        np.testing.assert_array_equal(out, wanted)
    assert "vperm" in "".join(pack.inspect_asm(pack.signatures[-1]))
"""


@pytest.mark.skipif(
    not get_host_cpu_features().get("avx2"), reason="the processor has no AVX2"
)
def test_lanes_are_packed_on_processors_that_cannot(tmp_path: Path) -> None:
    """By a table of eights, every row of it."""
    environment = os.environ | {
        "NUMBA_CPU_NAME": "haswell",
        "NUMBA_CPU_FEATURES": "+avx2",
        "NUMBA_CACHE_DIR": str(tmp_path),
    }
    subprocess.run(
        [sys.executable, "-c", PACK],
        cwd=Path(__file__).parents[3],
        env=environment,
        check=True,
    )
