"""What a picture took, added up when somebody asks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.bin_splats import FRAGMENT_BITS
from renderers.fsr.splats.splat_stages import STAGES, WAIT


@dataclass(frozen=True, slots=True)
class StripCost:
    """Tell what a strip took.

    listed, spans: elements that culling left, and rows that hold any. split: splats too
    near. visible: splats that showed. fragments: in parts of 2 ** `FRAGMENT_BITS`.
    ticks: by stage and of waiting, see `stages`, of a clock of unknown speed. seconds:
    of all of it.
    """

    listed: int
    spans: int
    split: int
    visible: int
    fragments: int
    ticks: NDArray[np.int64]
    seconds: float

    @property
    def waited_s(self) -> float:
        """Get the seconds of waiting for the threads that drew the other strips."""
        return float(self._by_stage[WAIT])

    def stage_s(self) -> dict[str, float]:
        """Give seconds by stage."""
        return dict(zip(STAGES, self._by_stage.tolist(), strict=False))

    @property
    def _by_stage(self) -> NDArray[np.float64]:
        share = self.seconds / max(int(self.ticks.sum()), 1)
        return np.multiply(self.ticks, share, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class PictureCost:
    """Hold what the strips of a picture took.

    rows: of the set. view_s: seconds of setting the view up, none where that and
    culling were done before.
    """

    strips: Sequence[StripCost]
    rows: int
    view_s: float | None = None

    def counters(self) -> dict[str, int]:
        """Add up; what several strips listed or drew counts for each."""
        rows = len(self.strips) * self.rows
        return {
            "listed": sum(strip.listed for strip in self.strips),
            "visible": sum(strip.visible for strip in self.strips),
            "split": max(strip.split for strip in self.strips),
            "rows": rows,
            "culled rows": rows - sum(strip.spans for strip in self.strips),
            "fragments": sum(strip.fragments for strip in self.strips) >> FRAGMENT_BITS,
        }

    def stage_s(self) -> dict[str, float]:
        """Give wall-clock seconds by stage, the mean of the strips."""
        stages = [strip.stage_s() for strip in self.strips]
        found = {name: sum(of[name] for of in stages) / len(stages) for name in STAGES}
        if self.view_s is None:
            del found["cull"]
            return found
        return {"view": self.view_s} | found
