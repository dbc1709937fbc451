"""Figures of two G-buffers of the same view."""

import numpy as np
import pytest

from benchmarks.references import depth_error, rgb_over_black, surface_counters
from renderers.scene import GBuffer


def plane(depth_mm: float, tilt_deg: float = 0.0) -> GBuffer:
    buffer = GBuffer.empty(20, 20)
    buffer.depth_mm[...] = depth_mm
    buffer.coverage[...] = 1
    tilt = np.radians(tilt_deg)
    buffer.normal[...] = (np.sin(tilt), 0, np.cos(tilt))
    return buffer


def test_depth_differs_by_what_it_was_moved() -> None:
    error = depth_error(plane(10.5), plane(10.0))
    assert (error.rmse, error.max, error.bias) == pytest.approx((0.5, 0.5, 0.5))


def test_angles_and_misses_are_counted() -> None:
    found, reference = plane(10.0, 7.0), plane(10.02)
    found.depth_mm[:5] = np.inf
    reference.depth_mm[-2:] = np.inf
    counters = surface_counters(found, reference)
    assert counters["normal_deg_mean"] == pytest.approx(7.0, abs=1e-4)
    assert counters["missing"] == pytest.approx(5 / 20)
    assert counters["extra"] == pytest.approx(2 / 20)
    assert counters["near"] == 1.0
    assert surface_counters(plane(10.2), plane(10.0))["near"] == 0.0


def test_nothing_in_common_is_no_error_figure() -> None:
    with pytest.raises(ValueError, match="no surface in common"):
        depth_error(GBuffer.empty(20, 20), plane(1.0))


def test_premultiplied_colour_is_the_colour_before_black() -> None:
    rgba = np.full((2, 2, 4), (0.1, 0.2, 0.3, 0.5), np.float32)
    assert np.array_equal(rgb_over_black(rgba), rgba[..., :3])
