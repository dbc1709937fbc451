"""A scan that can be shown as a volume, with the histogram of its densities."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume

BINS = 256
STRIDE = 2
"""Every so many voxels along each axis are counted: an eighth of them will do."""

SHARES = (0.1, 99.9)
"""Percentiles of an MR between which its densities are shown."""

CT_HU = (-1024.0, 2000.0)

TITLES = {"ct": "CT", "mr": "MR", "t1": "MR, T1", "t2": "MR, T2"}


@dataclass(frozen=True, slots=True)
class Scan:
    """A scan. name: ct, mr, t1 or t2. low, high: of the densities that are shown.

    counts: ``(BINS,)`` voxels of the sample between low and high, in order.
    """

    name: str
    volume: Volume
    low: float
    high: float
    counts: NDArray[np.int64]

    @property
    def title(self) -> str:
        """Return its name for a person."""
        return TITLES.get(self.name, self.name)

    @property
    def is_ct(self) -> bool:
        """Return whether densities are CT numbers."""
        return self.name == "ct"

    @classmethod
    def of(cls, name: str, volume: Volume) -> "Scan":
        """Take a volume; its shown range is the CT's own, or the MR's percentiles."""
        sample = np.asarray(volume.values)[::STRIDE, ::STRIDE, ::STRIDE]
        low, high = CT_HU
        if name != "ct":
            low, high = (float(v) for v in np.percentile(sample, SHARES))
            high = max(high, low + 1.0)
        counts, _ = np.histogram(sample, BINS, (low, high))
        return cls(name, volume, low, high, counts)

    def heights(self) -> NDArray[np.float64]:
        """Return the histogram's bars, 0 to 1, by the logarithm of their counts.

        Air is most of a scan: in proportion all else would be flat.
        """
        tall = np.log1p(self.counts.astype(np.float64))
        top = float(tall.max())
        return tall / top if top > 0 else tall


def scans_of(ct: Volume, others: Mapping[str, Volume]) -> list[Scan]:
    """Return the CT and whatever other scans there are."""
    volumes = {"ct": ct} | {n: others[n] for n in TITLES if n in others}
    return [Scan.of(name, volume) for name, volume in volumes.items()]
