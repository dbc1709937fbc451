"""Names for the numbers and arrays that compiled code takes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Lanes = Any
"""A vector: a type of the compiler alone, which lives inside kernels only."""

f32 = np.float32
i32 = np.int32
u64 = np.uint64

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Shorts = NDArray[np.int16]
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Flags = NDArray[np.bool_]
