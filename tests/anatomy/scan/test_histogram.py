"""Histograms whose peaks are known."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.phantom.phantom import Phantom
from anatomy.scan.histogram import (
    bone_transfer_function,
    classic_transfer_function,
    find_peaks,
    transfer_of,
)
from anatomy.tissue import TISSUES
from renderers.scene import TransferFunction
from renderers.scene.volume import Volume


def mixture(
    air: float, soft: float, bone: float, noise: float, bone_share: float = 0.1
) -> Volume:
    """Air, soft tissue and bone under one noise, in slabs."""
    rng = np.random.default_rng(0)
    shape = (40, 40, 40)
    hu: NDArray[np.float64] = np.full(shape, float(soft))
    hu[:15] = air
    count = round(40 * bone_share)
    if count:
        hu[-count:] = bone
    hu += noise * rng.normal(size=shape)
    return Volume(np.rint(hu).astype(np.int16), np.ones(3), np.zeros(3))


@given(
    air=st.floats(-1024, -850),
    soft=st.floats(-20, 80),
    bone=st.floats(700, 1500),
    noise=st.floats(6, 40),
)
def test_the_peaks_are_where_they_were_put(
    air: float, soft: float, bone: float, noise: float
) -> None:
    peaks = find_peaks(mixture(air, soft, bone, noise))
    # a peak of a noisy histogram is known to a part of its width, plus a bin
    assert abs(peaks.air - air) < 5 + 0.5 * noise
    assert abs(peaks.soft - soft) < 5 + 0.5 * noise
    assert peaks.bone is not None
    assert abs(peaks.bone - bone) < 5 + 0.2 * noise
    transfer = transfer_of(peaks)
    assert transfer.is_clear(-1100, peaks.air + 0.3 * (peaks.soft - peaks.air))
    _, kappa = transfer.evaluate(np.array([air, soft, bone]))
    assert kappa[0] == 0
    assert 0 < kappa[1] < kappa[2]


@given(shift=st.integers(-10, 10))
def test_a_scanner_that_is_off_takes_the_nodes_along(shift: int) -> None:
    """By whole bins, the nodes move with the numbers exactly."""
    here = mixture(-960, 40, 900, 15)
    moved = here.with_values(
        (here.values + np.int16(5 * shift)).astype(np.int16), -1000.0
    )
    first = transfer_of(find_peaks(here)).nodes
    second = transfer_of(find_peaks(moved)).nodes
    assert second - first == pytest.approx(np.full(len(first), 5.0 * shift))


def test_without_bone_there_is_no_ramp_for_it() -> None:
    peaks = find_peaks(mixture(-1000, 40, 900, 15, bone_share=0.0))
    assert peaks.bone is None
    assert transfer_of(peaks).kappa_per_mm.max() == 4
    # and where it is not asked for, bright fat of an MR is none
    assert find_peaks(mixture(-1000, 40, 900, 15), bone=False).bone is None


def test_a_head_has_three_levels(phantom: Phantom) -> None:
    peaks = find_peaks(phantom.ct)
    assert peaks.air == pytest.approx(-1000, abs=15)
    assert peaks.soft == pytest.approx(40, abs=15)
    assert peaks.bone is not None
    assert 60 < peaks.bone_begins < 250 < peaks.bone


def test_air_alone_is_refused() -> None:
    air = Volume(np.full((4, 4, 4), -1000, np.int16), np.ones(3), np.zeros(3))
    with pytest.raises(ValueError, match="no voxel has a CT number of soft tissue"):
        find_peaks(air)


def test_air_is_clear_and_mucosa_begins_at_the_half_value() -> None:
    preset = classic_transfer_function()
    assert preset.is_clear(-1000, -600)
    _, kappa = preset.evaluate(np.array([-600.0, -450.0, -300.0]))
    assert kappa[1] == pytest.approx((kappa[0] + kappa[2]) / 2)
    assert bone_transfer_function().is_clear(-1000, TISSUES["mucosa"].hu)


@pytest.mark.parametrize(
    ("preset", "low", "high"),
    [(classic_transfer_function, -600, 100), (bone_transfer_function, 60, 1500)],
)
def test_a_surface_has_one_colour_all_over_its_ramp(
    preset: Callable[[], TransferFunction], low: float, high: float
) -> None:
    """Else the voxels' distances from it would be drawn on it as bands."""
    color, kappa = preset().evaluate(np.linspace(low, high, 50))
    assert kappa[-1] > kappa[0]
    np.testing.assert_allclose(color, color[:1].repeat(50, axis=0), atol=1e-12)
