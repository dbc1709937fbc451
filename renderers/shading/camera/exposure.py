"""How bright the camera makes the picture."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene.gbuffer import TOOLS, read_only
from renderers.shading.kernels.camera_meter import count_within, find_gain, sample_light

TARGET = 0.17
"""Mean of the clipped luminance, weighted towards the centre, that a camera seeks."""
HIGHLIGHT = 1.0
"""What the 88th percentile of the largest channel may reach."""
HIGHLIGHT_SHARE = 0.88

LARGEST_GAIN = 1e5
"""Above it even a wall 10 cm away would be white; a black picture gets this."""
TOOL_WEIGHT = 0.001
"""Of a tool's pixel beside one of tissue: steel does not decide how bright tissue is,
but a picture of nothing else is exposed, too."""
_SAMPLES = 96
"""Samples along the shorter side: the meter needs no more than 9,000 pixels."""
_ROUNDS = 50
"""Far more than there are: a round each time that more samples clip."""


def meter(
    radiance: NDArray[np.float32], material: NDArray[np.uint8] | None = None
) -> float:
    """Return the gain that exposes a picture ``(h, w, 3)`` of linear radiance well.

    material: ``(h, w)``, what it shows, see `GBuffer`; None for tissue alone.

    The gain g makes the mean of min(g Y, 1), weighted by exp(-(r / .5)^2) inside
    r < .95 of the round field, reach `TARGET`, unless the highlights would then
    exceed `HIGHLIGHT`. Reads every few pixels only.
    """
    rows, columns, weight = _field(*radiance.shape[:2])
    luminance, largest = np.empty_like(weight), np.empty_like(weight)
    sample_light(read_only(radiance), rows, columns, luminance, largest)
    if material is not None:
        is_tool = np.isin(material[rows, columns], TOOLS)
        if is_tool.any():
            weight = np.where(is_tool, np.float32(TOOL_WEIGHT) * weight, weight)
            weight /= weight.sum()
            if np.mean(is_tool) < 1 - TOOL_WEIGHT:
                largest = largest[~is_tool]
    gain = find_gain(luminance, weight, TARGET, LARGEST_GAIN, _ROUNDS)
    if gain >= LARGEST_GAIN:
        return LARGEST_GAIN
    place = round(HIGHLIGHT_SHARE * (len(largest) - 1))
    if count_within(largest, np.float32(gain), np.float32(HIGHLIGHT)) > place:
        # most pictures: to order the samples takes as long as all the rest
        return gain
    largest.partition(place)
    return min(gain, HIGHLIGHT / float(largest[place]))


@lru_cache(maxsize=4)
def _field(
    height: int, width: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
    """Return the rows and columns of samples in the field, and their weights."""
    stride = max(1, min(height, width) // _SAMPLES)
    half = min(height, width) / 2
    rows = np.arange(height)[stride // 2 :: stride]
    columns = np.arange(width)[stride // 2 :: stride]
    y = (rows + 0.5 - height / 2) / half
    x = (columns + 0.5 - width / 2) / half
    r2 = y[:, None] ** 2 + x**2
    i, j = np.nonzero(r2 < 0.95**2)
    weight = np.exp(-r2[i, j] / 0.25)
    return (
        rows[i].astype(np.int32),
        columns[j].astype(np.int32),
        (weight / weight.sum()).astype(np.float32),
    )


@dataclass(slots=True)
class AutoGain:
    """Follow the metered gain as a camera does: exponentially, in stops.

    time_constant_s: time to close all but 1/e of the gap. gain: the present one;
    None before the first picture, which is exposed at once.
    """

    time_constant_s: float = 0.2
    gain: float | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.time_constant_s) and self.time_constant_s > 0):
            raise ValueError(
                f"the time constant must be positive, got {self.time_constant_s} s"
            )

    def follow(self, target: float, dt_s: float) -> float:
        """Move towards `target` for `dt_s` seconds; return the new gain.

        Two steps of dt do what one step of 2 dt does.
        """
        if not (math.isfinite(target) and target > 0):
            raise ValueError(f"a gain is positive and finite, got {target}")
        if not dt_s >= 0:
            raise ValueError(f"time cannot run backwards, got dt {dt_s} s")
        if self.gain is None:
            self.gain = target
        else:
            rest = math.exp(-dt_s / self.time_constant_s)
            self.gain = target * (self.gain / target) ** rest
        return self.gain
