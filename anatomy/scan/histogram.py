"""The transfer function that fits a scan's own histogram.

A head has three levels: air, soft tissue and bone. The first two are peaks. Bone is a
long tail that starts where the flank of the soft tissues ends; its ramp is placed
between that end and the tail's middle. Where a scanner's numbers are off, so are the
peaks, and the nodes follow them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import SURFACE_HU
from renderers.scene.transfer import TransferFunction
from renderers.scene.volume import AIR_HU, Volume
from system import UserError

BINS, RANGE_HU = 800, (-1100.0, 2900.0)
"""Bins of 5 HU: narrower than the noise of any scan."""

SMOOTH_BINS = 5

SOFT_HU = (-200.0, 300.0)
"""Where the peak of soft tissue is looked for."""

BONE_SPREADS = 4.0
"""Of the soft tissues' upper flank: what is higher is bone."""

WIDEST_FLANK_HU = 80.0
"""A flank that enhanced vessels or noise make wider counts as this wide."""

LEAST_BONE = 2e-3
"""Share of the voxels above air; with less the scan shows no bone."""

MUCOSA, EDGE, BONE, IVORY = (
    (0.53, 0.18, 0.16),
    (0.75, 0.55, 0.42),
    (0.85, 0.78, 0.62),
    (0.90, 0.87, 0.80),
)
"""Linear colours of the classic preset: soft tissue has one, or bands would show."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """The levels of a head, in CT numbers.

    air, soft: the peaks' places. flank: deviation of the soft tissues' upper flank.
    bone: the middle of what is higher; None where there is no bone to be seen.
    """

    air: float
    soft: float
    flank: float
    bone: float | None

    @property
    def bone_begins(self) -> float:
        """Return the number from which on tissue counts as bone."""
        return self.soft + BONE_SPREADS * self.flank


def counts_of(ct: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the histogram: middles of the bins, and shares of all voxels."""
    values = np.asarray(ct.values)
    counts, edges = np.histogram(values, BINS, RANGE_HU)
    return (edges[:-1] + edges[1:]) / 2, counts / max(values.size, 1)


def find_peaks(ct: Volume, *, bone: bool = True) -> Peaks:
    """Find air, soft tissue and bone in the CT numbers of a head.

    bone: look for it; an MR on the scale of CT shows fat there instead. Raises
    UserError where soft tissue makes no peak, as in a box of air.
    """
    centers, shares = counts_of(ct)
    smooth = np.convolve(shares, np.ones(SMOOTH_BINS) / SMOOTH_BINS, mode="same")
    is_air = centers < SURFACE_HU
    is_soft = (centers >= SOFT_HU[0]) & (centers <= SOFT_HU[1])
    if not smooth[is_soft].any():
        raise UserError(
            f"no voxel has a CT number of soft tissue, {SOFT_HU[0]:g} to {SOFT_HU[1]:g}"
        )
    air = AIR_HU
    if smooth[is_air].any():
        air = float(centers[is_air][smooth[is_air].argmax()])
    top = int(np.flatnonzero(is_soft)[0] + smooth[is_soft].argmax())
    soft = float(centers[top])
    # fat lies on the lower flank, so the spread is read off the upper one
    below = np.flatnonzero(smooth[top:] < np.exp(-0.5) * smooth[top])
    width = float(below[0]) if len(below) else 1.0
    step = float(centers[1] - centers[0])
    flank = min(max(width, 1.0) * step, WIDEST_FLANK_HU)
    peaks = Peaks(air, soft, flank, None)
    high = centers > peaks.bone_begins
    share = float(shares[high].sum())
    if not bone or share < LEAST_BONE * max(float(shares[~is_air].sum()), 1e-12):
        return peaks
    total = np.cumsum(shares[high])
    middle = float(centers[high][np.searchsorted(total, total[-1] / 2)])
    return Peaks(air, soft, flank, max(middle, peaks.bone_begins + 2 * step))


def transfer_of(peaks: Peaks) -> TransferFunction:
    """Return the function of mode `classic` for peaks: clear air, red mucosa, bone.

    Its ramp into mucosa is centred half-way between air and soft tissue: there alone
    its place does not depend on the scanner's blur.
    """
    step = peaks.soft - peaks.air
    half = (peaks.air + peaks.soft) / 2
    nodes = [peaks.air, half - 0.15 * step, half + 0.15 * step, peaks.soft]
    color, kappa = [MUCOSA] * 4, [0.0, 0.0, 4.0, 4.0]
    if peaks.bone is not None:
        nodes += [peaks.bone_begins, peaks.bone, peaks.bone + step]
        color += [EDGE, BONE, IVORY]
        kappa += [6.0, 20.0, 40.0]
    return TransferFunction(np.array(nodes), np.array(color), np.array(kappa))


def classic_transfer_function() -> TransferFunction:
    """Return the preset for mode `classic`: red mucosa, ivory bone, clear air.

    The ramp into mucosa is centred on -480 HU, half way from air: there alone its
    place does not depend on the scanner's blur. All its colours are one: a surface is
    made of voxels from all over the ramp, and others would draw bands on it.
    """
    nodes = [-1000.0, -600.0, -300.0, 100.0, 250.0, 700.0, 1500.0]
    color = [MUCOSA] * 4 + [EDGE, BONE, IVORY]
    kappa = [0.0, 0.0, 4.0, 4.0, 6.0, 20.0, 40.0]
    return TransferFunction(np.array(nodes), np.array(color), np.array(kappa))


def bone_transfer_function() -> TransferFunction:
    """Return the preset that shows bone through faint soft tissue.

    Thin walls reach 100-400 HU at clinical resolution, so its ramp starts there. Bone
    has one colour, see `classic_transfer_function`.
    """
    nodes = np.array([-1000.0, 60.0, 140.0, 500.0, 1500.0])
    color = np.tile((0.87, 0.81, 0.70), (len(nodes), 1))
    return TransferFunction(nodes, color, np.array([0.0, 0.0, 1.0, 8.0, 30.0]))
