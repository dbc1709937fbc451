"""The proof that skipping loses nothing: how many values have other bits."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene import ImageError
from system import UserError

COMPARED = "values compared"
DIFFER = "values that differ"


def differing(found: NDArray[Any], wanted: NDArray[Any]) -> int:
    """Count values whose bits differ, so that -0.0 is not 0.0 and NaN is itself.

    Raises UserError for arrays of different shapes or types.
    """
    if found.shape != wanted.shape or found.dtype != wanted.dtype:
        raise UserError(
            f"cannot compare {found.dtype} {found.shape} with "
            f"{wanted.dtype} {wanted.shape}"
        )
    bits = np.dtype(f"u{found.dtype.itemsize}")
    same = np.ascontiguousarray(found).view(bits) == np.ascontiguousarray(wanted).view(
        bits
    )
    return int(np.count_nonzero(~same))


def share_error(share: float) -> ImageError:
    """Return the share of values that differ as an error."""
    return ImageError(rmse=share, p999=0.0, max=float(share > 0), bias=share)
