"""A compiled tick on fields of known form: what its tests have in common."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surgery.kernels import touch_force as tick
from surgery.kernels.touch_force import Patch

H = 0.5
N = 48
"""Voxels a side of a patch whose middle is the origin."""

MIDDLE = (N - 1) / 2
Doubles = NDArray[np.float64]


def axes() -> tuple[Doubles, Doubles, Doubles]:
    """Give x, y, z of all voxels."""
    along = (np.arange(N) - MIDDLE) * H
    z, y, x = np.meshgrid(along, along, along, indexing="ij")
    return x, y, z


def patch_of(depth: Doubles, wall: int = 1) -> Patch:
    """Make a patch of one wall; depth: mm of tissue, negative in air."""
    voxel = np.zeros((3, 4))
    voxel[:, :3], voxel[:, 3] = np.eye(3) / H, MIDDLE
    values = depth.astype(np.float32)
    rows = np.full(values.shape, wall, np.uint8)
    return Patch(values, voxel, values.copy(), rows, np.zeros_like(rows))


def floor() -> Patch:
    """Tissue below z = 0."""
    return patch_of(-axes()[2])


def ball() -> Patch:
    """A ball of tissue of 12 voxels radius."""
    x, y, z = axes()
    return patch_of(12 * H - np.sqrt(x * x + y * y + z * z))


def groove(half_deg: float) -> Patch:
    """Air above two planes that meet along y, each so far from the vertical."""
    x, _, z = axes()
    half = np.radians(half_deg)
    return patch_of(
        -np.minimum(*(z * np.sin(half) + s * x * np.cos(half) for s in (1, -1)))
    )


def sheet(thickness_mm: float = H) -> Patch:
    """A wall of one voxel across z = 0, air on both sides."""
    return patch_of(thickness_mm / 2 - np.abs(axes()[2]))


@dataclass
class Tick:
    """Call the tick for one ball of a tool, or several, in a patch."""

    patch: Patch
    balls: Doubles = field(default_factory=lambda: np.array([[0.0, 0.0, 0.0, 1.0]]))
    soft: float = 0.5
    hard: float = 0.5
    bone_mm: float = 0.0
    mucosa_mm: float = 0.0
    friction: float = 0.0
    break_n: float = 0.0
    period_s: float = 1e-3
    damping: float = 0.0
    viscous: float = 0.0
    stiffest: float = np.inf
    most_n: float = np.inf
    pull_n: float = 0.0

    def __post_init__(self) -> None:
        self.walls = np.zeros((256, tick.FEEL))
        self.walls[:] = (
            *(self.mucosa_mm, self.bone_mm, self.soft, self.hard),
            *(self.friction, self.viscous, self.break_n),
        )
        self.grounds = np.full(256, self.soft)
        self.state = np.zeros(tick.STATE)
        self.holes = np.zeros(tick.HOLES)
        self.out = np.zeros(tick.OUT)
        self.work = np.zeros((len(self.balls) + tick.BEHIND, tick.WORK))
        self.flags = 0

    def at(
        self, place: ArrayLike, dt: float | None = None, turn: Doubles | None = None
    ) -> Doubles:
        """Go there in one tick; gives the force."""
        pose = np.eye(4)
        pose[:3, 3] = place
        if turn is not None:
            pose[:3, :3] = turn
        settings = np.zeros(tick.SETTINGS)
        settings[tick.DT] = self.period_s if dt is None else dt
        settings[tick.PERIOD] = self.period_s
        settings[tick.STIFFEST], settings[tick.MOST_N] = self.stiffest, self.most_n
        settings[tick.DAMPING], settings[tick.PULL_N] = self.damping, self.pull_n
        self.flags = tick.touch_tick(
            *(self.patch, self.walls, self.grounds, self.balls, pose, settings),
            *(self.state, self.holes, self.work, self.out),
        )
        return self.out[tick.FORCE : tick.FORCE + 3].copy()

    def along(self, places: ArrayLike) -> Doubles:
        """Go from place to place; gives the forces ``(n, 3)``."""
        return np.array([self.at(place) for place in np.asarray(places, float)])

    def proxy(self) -> Doubles:
        """Give where the proxy's origin is."""
        return self.state[tick.PROXY : tick.PROXY + 3].copy()
