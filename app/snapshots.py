"""High-quality pictures of chosen moments, and how far the live ones were off."""

import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.comparison import difference, save_comparison
from app.endoscope_view import Frame
from app.operating_room import OperatingRoom, Progress
from app.rendering_service import running_worker
from renderers.art import SnapshotClient, SnapshotRequest
from renderers.scene import Mesh
from scenarios import Moment, View


@dataclass(slots=True)
class Keepsake:
    """Keep the frame that is nearest to a moment of the flight."""

    moment: Moment
    view: View | None = None
    frame: Frame | None = None
    number: int = 0
    off_s: float = float("inf")

    def offer(self, number: int, view: View, frame: Frame, time_s: float) -> None:
        """Take the frame if it is nearer than the one that is kept."""
        off = abs(time_s - self.moment.time_s)
        if off < self.off_s:
            self.view, self.frame = view, frame
            self.number, self.off_s = number, off


@dataclass(frozen=True, slots=True)
class TakenSnapshot:
    """Report one snapshot and the live picture's distance from it.

    seconds: of the worker, from claim to result. rmse: 8-bit codes.
    """

    name: str
    file: str
    seconds: float
    ranks: int
    rmse: float
    ssim: float
    p99: float
