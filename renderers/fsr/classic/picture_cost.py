"""What a picture took, added up when somebody asks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernels import FRAGMENT_BITS

STAGES = ("project", "order", "draw")


@dataclass(frozen=True, slots=True)
class StripCost:
    """Tell what a strip took.

    listed, spans: elements that culling left, and rows that hold any. split: splats too
    near. visible: splats that showed. fragments: in parts of 2 ** `FRAGMENT_BITS`.
    ticks: by stage, of a clock of unknown speed. seconds: of all stages.
    """

    listed: int
    spans: int
    split: int
    visible: int
    fragments: int
    ticks: NDArray[np.int64]
    seconds: float

    def stage_s(self) -> dict[str, float]:
        """Give seconds by stage."""
        shares = self.ticks / max(int(self.ticks.sum()), 1) * self.seconds
        return dict(zip(STAGES, shares.tolist(), strict=True))


@dataclass(frozen=True, slots=True)
class PictureCost:
    """Hold what the strips of a picture took.

    rows: of the set. view_s, cull_s: seconds of setting the view up and of culling,
    none where that was done before.
    """

    strips: Sequence[StripCost]
    rows: int
    view_s: float | None = None
    cull_s: float | None = None

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
        before = {"view": self.view_s, "cull": self.cull_s}
        found = {stage: s for stage, s in before.items() if s is not None}
        stages = [strip.stage_s() for strip in self.strips]
        for stage in STAGES:
            found[stage] = sum(of[stage] for of in stages) / len(stages)
        return found
