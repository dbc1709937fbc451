"""Names for the types that kernels take and give."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I16 = NDArray[np.int16]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
U16 = NDArray[np.uint16]
U64 = NDArray[np.uint64]
Flags = NDArray[np.bool_]
Real = float | np.float32
Lanes = Any
"""A vector of `renderers.simd`, or a number that must not become a literal type."""
