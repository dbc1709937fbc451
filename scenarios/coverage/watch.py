"""Follow what mucosa and which landmarks a scope sees, sample by sample.

It asks no clock: it looks `RATE_HZ` times a second of the samples' time, so the same
samples give the same figures, whatever machine steps them and however often samples
come.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Volume
from renderers.scene.lens_state import CLEAN, LensState
from scenarios.coverage.patches import Mucosa
from scenarios.tasks.rules import is_in_sight

Doubles = NDArray[np.float64]

RATE_HZ = 5
"""How often is looked, of the score's clock."""

SIZE = 64
"""Rays across the round picture: 1.25 degrees apart, most of a patch at the far end."""

LEAST_SHARE = 0.5
"""A look sees a patch when rays that stand for half of its area meet it. With any ray
that meets it, patches on the edge of what is in sight would all count."""

SEEN_S = 0.4
"""A patch counts as seen when it was in sight so long: two looks, so that a flash on
the way does not count. A design value: no source gives one."""

MOST_INCIDENCE_DEG = 75.0
"""Flatter than this nobody judges mucosa (training.md C4)."""

FARTHEST_MM = 35.0
"""Beyond it the light of a scope leaves mucosa dark: a design value, of a working
distance of 5 to 30 mm."""

FOCUS_MM, DEFOCUS_PX, SHARP = 12.0, 1.3, 0.12
"""Of the camera's blur ``DEFOCUS_PX max(|6/t - 6/FOCUS_MM| - SHARP, 0)``, pixels of a
picture 480 wide; see `renderers.shading.camera`."""

MOST_BLUR_PX = 1.5
"""Largest radius of either blur, of those pixels: where detail of 3 is gone."""

PICTURE_PX, SHUTTER_S = 480.0, 1.0 / 250.0
"""The picture that blur is counted in, and how long it is exposed to a bright wall."""

MOST_SOIL, MOST_FOG = 0.3, 0.3
"""A lens that is dirtier than this is not clear."""

LANDMARK_DEG, LANDMARK_S = 15.0, 0.6
"""A landmark is seen when it is in sight and so near the middle of the picture, for so
long (training.md C4 leaves both to the scenario)."""

CHECK_STEP_MM = 0.2
"""Step of the rays that check: thinner than any wall of the grid."""


def nearest_sharp_mm() -> float:
    """Return the distance below which the picture is out of focus."""
    return 6.0 / (6.0 / FOCUS_MM + SHARP + MOST_BLUR_PX / DEFOCUS_PX)


@dataclass(frozen=True, slots=True)
class SiteSeen:
    """Sum up a site: its area, how much of it was seen, and what that may err by.

    uncertain_percent: 1 sigma of `seen_percent`: by how much rays from checked places
    of the wall to the eye see more or less than the item buffer, and, added in squares,
    how well so few places tell.
    """

    area_mm2: float
    seen_percent: float
    uncertain_percent: float


@dataclass(frozen=True, slots=True)
class CoverageFigures:
    """Sum up what was seen: sites by name, and when landmarks were, in their order."""

    sites: dict[str, SiteSeen]
    landmarks_s: dict[str, float]


@dataclass(frozen=True, slots=True)
class CoverageState:
    """A watch between two samples; see `CoverageWatch.checkpoint`."""

    looks: NDArray[np.int32]
    checks: NDArray[np.int32]
    held: NDArray[np.int32]
    landmarks_s: dict[str, float]
    tick: int | None
    frame: Doubles | None


class CoverageWatch:
    """Count for how long each patch of mucosa was in sight.

    mucosa: the patches. looks: ``(patches,)`` at how many looks each was seen.
    """

    def __init__(
        self,
        mucosa: Mucosa,
        landmarks: Mapping[str, Doubles] | None = None,
    ) -> None:
        """Begin to watch; landmarks: ``(3,)`` LPS mm by name."""
        self.mucosa = mucosa
        self.looks = np.zeros(len(mucosa.area_mm2), np.int32)
        self._checks = np.zeros(len(mucosa.checked), np.int32)
        landmarks = landmarks or {}
        self._names = tuple(sorted(landmarks))
        places = [landmarks[name] for name in self._names]
        self._landmarks = np.array(places, np.float64).reshape(-1, 3)
        self._held = np.zeros(len(places), np.int32)
        self._landmarks_s: dict[str, float] = {}
        self._tick: int | None = None
        self._frame: Doubles | None = None
        self._lens: tuple[float, Doubles] | None = None

    def is_due(self, time_s: float) -> bool:
        """Return whether a look is due at a time of the score's clock."""
        return self._tick is None or math.floor(time_s * RATE_HZ) > self._tick

    def step(
        self,
        time_s: float,
        camera: Camera,
        distance: Volume,
        lens: LensState = CLEAN,
    ) -> None:
        """Take in what a sample sees; times must not run backwards.

        camera: of any size. distance: of the head as it is cut. lens: of the scope.
        """
        if not self.is_due(time_s):
            return
        tick = math.floor(time_s * RATE_HZ)
        follows = self._tick is not None and tick == self._tick + 1
        before = self._frame if follows else None
        self._tick, self._frame = tick, camera.frame
        is_clear = lens.soil <= MOST_SOIL and lens.fog <= MOST_FOG
        if not (is_clear and np.all(np.isfinite(camera.frame))):
            self._held[:] = 0
            return
        self._look(camera, distance, before)
        self._look_at_landmarks(time_s, camera, distance)

    def _look(self, camera: Camera, distance: Volume, before: Doubles | None) -> None:
        # Imported here: this module's names are needed where nothing is compiled.
        from scenarios.coverage.kernels.item_buffer import (
            Air,
            Seeing,
            add_seen,
            check_seen,
        )

        mucosa = self.mucosa
        air = Air(
            distance.values,
            np.ascontiguousarray(distance.voxel_from_world[:3]),
            0.5 * float(distance.spacing_mm.min()),
        )
        pixels_per_rad = PICTURE_PX / (2.0 * camera.extent)
        seeing = Seeing(
            np.ascontiguousarray(camera.frame),
            np.ascontiguousarray(camera.frame if before is None else before),
            0.0 if before is None else 1.0 / RATE_HZ,
            nearest_sharp_mm(),
            FARTHEST_MM,
            math.cos(math.radians(MOST_INCIDENCE_DEG)),
            math.cos(camera.extent),
            MOST_BLUR_PX / SHUTTER_S / pixels_per_rad,
        )
        seen_mm2 = np.zeros(len(self.looks))
        add_seen(
            air,
            seeing,
            self._rays(camera),
            mucosa.table,
            mucosa.block,
            mucosa.blocks,
            seen_mm2,
        )
        self.looks += seen_mm2 >= LEAST_SHARE * mucosa.area_mm2
        checked = np.zeros(len(self._checks), np.bool_)
        check_seen(
            air,
            seeing,
            mucosa.checked,
            mucosa.checked_normals,
            CHECK_STEP_MM,
            checked,
        )
        self._checks += checked

    def _rays(self, camera: Camera) -> Doubles:
        """Return the lens's rays inside the round field stop, and their solid angles.

        Of a lens r = f theta: a pixel of angle p has p^2 sin(theta) / theta.
        """
        if self._lens is None or self._lens[0] != camera.extent:
            table = camera.with_size(SIZE, SIZE).lens_table().reshape(-1, 3)
            rays = table[table[:, 2] >= math.cos(camera.extent)].astype(np.float64)
            angle = np.arccos(np.minimum(rays[:, 2], 1.0))
            pixel = 2.0 * camera.extent / SIZE
            solid = pixel**2 * np.sinc(angle / math.pi)
            self._lens = camera.extent, np.column_stack([rays, solid])
        return self._lens[1]

    def _look_at_landmarks(
        self, time_s: float, camera: Camera, distance: Volume
    ) -> None:
        away = self._landmarks - camera.frame[0]
        length = np.linalg.norm(away, axis=1)
        centred = away @ camera.frame[3]
        near = centred >= length * math.cos(math.radians(LANDMARK_DEG))
        near &= length <= FARTHEST_MM
        for n, name in enumerate(self._names):
            if name in self._landmarks_s:
                continue
            place = self._landmarks[n]
            if near[n] and is_in_sight(distance, camera.frame[0], place):
                self._held[n] += 1
                if self._held[n] >= LANDMARK_S * RATE_HZ:
                    self._landmarks_s[name] = time_s
            else:
                self._held[n] = 0

    @property
    def seconds(self) -> Doubles:
        """Return for how long each patch was in sight, s."""
        return self.looks / RATE_HZ

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Return which patches count as seen."""
        return np.asarray(self.looks >= SEEN_S * RATE_HZ)

    def percent(self, name: str) -> float:
        """Return how much of a site was seen, by area; KeyError for no such site."""
        chosen = np.isin(self.mucosa.site, self.mucosa.members[name])
        area = self.mucosa.area_mm2[chosen]
        return float(100.0 * area[self.seen[chosen]].sum() / area.sum())

    def figures(self) -> CoverageFigures:
        """Return what was seen so far, by site."""
        mucosa, seen = self.mucosa, self.seen
        area = np.bincount(mucosa.site, mucosa.area_mm2, len(mucosa.sites))
        in_sight = np.bincount(
            mucosa.site[seen], mucosa.area_mm2[seen], len(mucosa.sites)
        )
        by_buffer = seen[mucosa.checked_patch].astype(np.float64)
        by_ray = (self._checks >= SEEN_S * RATE_HZ).astype(np.float64)
        at, count = mucosa.site[mucosa.checked_patch], len(mucosa.sites)
        checked = np.bincount(at, minlength=count)
        wrong = np.bincount(at, np.abs(by_buffer - by_ray), count)
        bias = np.bincount(at, by_buffer - by_ray, count)
        # few places that all agree do not prove that there is no error: one more is
        # taken to be wrong
        doubt = 100.0 * np.sqrt(bias**2 + wrong + 1.0) / (checked + 1.0)
        sites = {
            name: SiteSeen(
                float(area[n]),
                float(100.0 * in_sight[n] / area[n]),
                float(doubt[n]),
            )
            for n, name in enumerate(mucosa.sites)
        }
        return CoverageFigures(sites, dict(self._landmarks_s))

    def checkpoint(self) -> CoverageState:
        """Return all that later samples may change."""
        return CoverageState(
            self.looks.copy(),
            self._checks.copy(),
            self._held.copy(),
            dict(self._landmarks_s),
            self._tick,
            self._frame,
        )

    def restore(self, state: CoverageState) -> None:
        """Go back, or on, to a state of this watch."""
        self.looks = state.looks.copy()
        self._checks = state.checks.copy()
        self._held = state.held.copy()
        self._landmarks_s = dict(state.landmarks_s)
        self._tick, self._frame = state.tick, state.frame


class SeenPercent(Mapping[str, float]):
    """Tell how much of each site was seen, percent, computed when it is asked for."""

    def __init__(self, watch: CoverageWatch) -> None:
        self._watch = watch

    def __getitem__(self, name: str) -> float:
        return self._watch.percent(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._watch.mucosa.members)

    def __len__(self) -> int:
        return len(self._watch.mucosa.members)
