"""CT numbers on the crests of thin walls, as a scan with thick slices shows them.

A real head CT to compare with: 0.49 mm pixels, standard kernel, 4 mm slices. Its septa
between ethmoid cells have peaks of median -254 HU (10-90 %: -533 to 39, 324 septa), its
orbits' medial walls of 40 to 66 HU in three slices (10-90 %: -80 to 730).
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import ethmoid_block, lamina_papyracea
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.tissue import Side

SLICE_MM = 4.0
STANDARD_KERNEL = PhantomParameters(edge_blur_mm=0.6, mucosa_mm=0.3)
"""The default head in such a scanner."""

_SPACING_MM = 0.5


def septa_head(parameters: PhantomParameters = STANDARD_KERNEL) -> Phantom:
    """Build what `septum_peaks` looks at: the right ethmoid."""
    box = ((-18.0, -3.0), (12.0, 56.0), (22.0, 54.0))
    return build_phantom(parameters, _SPACING_MM, field_mm=box)


def septum_peaks(phantom: Phantom) -> NDArray[np.float64]:
    """List CT numbers on the crests of walls inside the right ethmoid, HU.

    A peak is the maximum across a wall, 100 HU above what is on both sides.
    """
    h, o = phantom.spacing_mm, phantom.ct.origin_mm
    thick = _averaged(phantom.ct.values, h)
    index = np.indices(phantom.ct.shape).reshape(3, -1)
    place = lps_from_ras((o[:, None] + h * index[::-1]).T).T
    block = ethmoid_block(phantom.parameters, Side.RIGHT).evaluate(place)
    inside = (block < -1.8).reshape(phantom.ct.shape)
    found = []
    for axis in (1, 2):
        crest = inside & (thick == ndimage.maximum_filter1d(thick, 7, axis=axis))
        beside = [
            ndimage.minimum_filter1d(thick, 7, axis=axis, origin=origin)
            for origin in (-3, 3)
        ]
        found.append(thick[crest & (thick - np.maximum(*beside) > 100)])
    return np.concatenate(found)


def lamina_peaks(
    side: Side, parameters: PhantomParameters = STANDARD_KERNEL
) -> NDArray[np.float64]:
    """List CT numbers on the orbit's medial wall beside aired cells, HU."""
    sign = 1.0 if side == Side.LEFT else -1.0
    x = (3.0, 24.0) if side == Side.LEFT else (-24.0, -3.0)
    box = (x, (12.0, 52.0), (22.0, 54.0))
    phantom = build_phantom(parameters, _SPACING_MM, field_mm=box)
    h, o = phantom.spacing_mm, phantom.ct.origin_mm
    slab = round(SLICE_MM / h)
    thick = _averaged(phantom.ct.values, h)
    deep = _averaged(phantom.distance.values < -0.4, h)
    lateral = sign * (o[0] + h * np.arange(phantom.ct.shape[2]))
    lamina = lamina_papyracea(parameters, side)
    found = []
    for k in range(slab, phantom.ct.shape[0] - slab, slab // 2):
        for j in range(phantom.ct.shape[1]):
            y, z = -(o[1] + h * j), o[2] + h * k
            if not (-48 < y < -20 and 30 < z < 46):
                continue
            off = lateral - lamina.evaluate(np.array([[0.0], [y], [z]]))[0]
            # An aired cell beside the wall, through the whole thickness of the slice.
            if deep[k, j, (off > -3) & (off < -1)].max() > 0.95:
                found.append(thick[k, j, np.abs(off) < 2].max())
    return np.array(found)


def _averaged(values: NDArray[np.generic], spacing_mm: float) -> NDArray[np.float64]:
    """Average over a slice's thickness along z."""
    thick: NDArray[np.float64] = ndimage.uniform_filter1d(
        values.astype(np.float64), round(SLICE_MM / spacing_mm), axis=0
    )
    return thick
