"""A coarser picture where a finer one is not done yet."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene import GBuffer, Image


def fill(
    found: GBuffer | Image, done: NDArray[np.bool_], coarse: GBuffer | Image
) -> GBuffer | Image:
    """Show a coarser picture of the same view where a picture is not done yet."""
    rows, columns = (
        _nearest(size, other, min(found.size), min(coarse.size))
        for size, other in zip(found.size, coarse.size, strict=True)
    )

    def mixed(fine: NDArray[Any], rough: NDArray[Any]) -> NDArray[Any]:
        mask = done.reshape(done.shape + (1,) * (fine.ndim - 2))
        return np.where(mask, fine, rough[rows[:, None], columns])

    if isinstance(found, Image):
        assert isinstance(coarse, Image)
        assert found.depth_mm is not None
        assert coarse.depth_mm is not None
        return Image(
            mixed(found.rgba, coarse.rgba), mixed(found.depth_mm, coarse.depth_mm)
        )
    assert isinstance(coarse, GBuffer)
    return replace(
        found,
        depth_mm=mixed(found.depth_mm, coarse.depth_mm),
        normal=mixed(found.normal, coarse.normal),
        coverage=mixed(found.coverage, coarse.coverage),
        material=mixed(found.material, coarse.material),
    )


def _nearest(size: int, other: int, short: int, other_short: int) -> NDArray[np.intp]:
    """Find the coarse pixel whose centre lies nearest to each fine one's.

    short: the pictures' shorter sides, which the lens's field falls on.
    """
    at = (np.arange(size) + 0.5 - size / 2) * (other_short / short) + other / 2
    nearest: NDArray[np.intp] = np.clip(np.floor(at), 0, other - 1).astype(np.intp)
    return nearest
