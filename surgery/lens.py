"""What gets on the front lens of the scope: blood, mucus, water; and how it is washed.

All follows from the samples, in fixed steps of their time. Design figures: a cold lens
fogs within some ten seconds in a warm nose, a warm one hardly does. What touches the
lens smears the part of it that it touches: mucosa in proportion to the force of the
touch, dry skin hardly at all, blood where there is blood, at once. Washing takes two
seconds and leaves drops, which run off.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface
from renderers.scene.lens_state import SECTORS, LensState, Sectors
from renderers.scene.scene import FILM_UNIT_MM
from surgery.film import STEPS_PER_S
from system import UserError

Doubles = NDArray[np.float64]

WASH_S = 2.0
"""Time that washing takes."""

ROOM_C, NOSE_C, LIT_C, DEW_C = 22.0, 33.0, 3.0, 31.0
"""Temperature of the room and of the nose, how much the scope's light warms its lens,
and the temperature below which breath condenses on it."""

WARMING_S = 45.0
"""Time constant of the lens's temperature."""

FOGS_PER_S = 0.012
"""Fog that a degree below the dew point makes in a second."""

DRIES_S = 12.0
"""Time constant of fog that leaves a warm lens."""

AGENT_S = 240.0
"""Time constant of the anti-fog agent that washing leaves."""

SMEARS_PER_NS = 1.2
"""Share of a part of the lens that mucosa smears in a second of touch, per newton."""
DRY = 0.01
"""How much of that skin does."""

BLOOD_PER_S = 6.0
"""Share that blood covers in a second, per mm of its thickness, thickest `THICK_MM`."""
THICK_MM = 0.5

WINDOW, BEHIND = 0.7, 0.29
"""Radius of the window that the lens is behind, of the tip's, and how far it lies
behind the tip, which is round: on the ball that tissue meets."""

WETS_MM = 0.35
"""Tissue that is nearer than this, or so much nearer than its blood is thick, wets the
window; so much beyond it, it lies on it flatly."""

RUNS_OFF_S = 1.5
"""Time constant of the drops that washing leaves."""

_TURNS = [math.tau * n / SECTORS for n in range(SECTORS)]
_ACROSS = np.array([(math.cos(turn), math.sin(turn)) for turn in _TURNS])


@dataclass(frozen=True, slots=True)
class LensCheckpoint:
    """What is on a lens, how warm it is and what was counted, see `Lens`."""

    blood: tuple[float, ...]
    mucus: tuple[float, ...]
    fog: float
    drops: float
    agent: float
    lens_c: float
    step: int | None
    left: int
    touches_s: float
    washes: int


class Lens:
    """Follow a scope's front lens through an operation.

    state: what `CameraPass` draws. touches_s: seconds that it touched tissue so far.
    washes: how often it was washed, each for `WASH_S`. Undoing a cut does not clean it.
    """

    def __init__(
        self, surface: AirSurface, radius_mm: float, start_c: float = ROOM_C
    ) -> None:
        """Begin with a clean lens.

        surface: as it is carved, with its wounds' film; both are read in place.
        radius_mm: of the scope's tip. start_c: temperature at first; surgeons warm it.
        """
        if not (math.isfinite(radius_mm) and radius_mm > 0):
            raise UserError(f"a scope has a positive radius, got {radius_mm} mm")
        self._surface = surface
        self._radius_mm = radius_mm
        self._blood, self._mucus = np.zeros(SECTORS), np.zeros(SECTORS)
        self._fog = self._drops = self._agent = 0.0
        self._lens_c = start_c
        self._step: int | None = None
        self._left = 0
        self.touches_s = 0.0
        self.washes = 0

    @property
    def state(self) -> LensState:
        """Return what lies on the lens now."""
        blood, mucus = _sectors(self._blood), _sectors(self._mucus)
        return LensState(blood, mucus, self._fog, self._drops, self.washes)

    def checkpoint(self) -> LensCheckpoint:
        """Return all that later samples may change."""
        return LensCheckpoint(
            tuple(self._blood.tolist()),
            tuple(self._mucus.tolist()),
            self._fog,
            self._drops,
            self._agent,
            self._lens_c,
            self._step,
            self._left,
            self.touches_s,
            self.washes,
        )

    def restore(self, state: LensCheckpoint) -> None:
        """Make the lens what it was."""
        self._blood, self._mucus = np.array(state.blood), np.array(state.mucus)
        self._fog, self._drops, self._agent = state.fog, state.drops, state.agent
        self._lens_c, self._step, self._left = state.lens_c, state.step, state.left
        self.touches_s, self.washes = state.touches_s, state.washes

    def wash(self) -> None:
        """Begin to wash, at the pedal or key; nothing where that goes on already."""
        if self._left == 0:
            self._left = round(WASH_S * STEPS_PER_S)
            self.washes += 1

    def advance(self, time_s: float, frame: Doubles, force_n: float) -> None:
        """Follow the scope to a sample's time; the first call sets the beginning.

        frame: ``(4, 3)`` LPS, of that sample, where the lens was since the last one:
        the tip, the picture's right and up, the way the shaft points. One that is not
        finite counts as outside. force_n: of tissue on the tip.
        """
        if not math.isfinite(time_s):
            raise UserError(f"a sample's time is finite, got {time_s} s")
        last = math.floor(time_s * STEPS_PER_S)
        steps = 0 if self._step is None else max(last - self._step, 0)
        self._step = last if self._step is None else max(last, self._step)
        if steps == 0:
            return
        gap = self._gap(frame[0])
        blood = mucus = np.zeros(SECTORS)
        if gap < self._radius_mm + WETS_MM + THICK_MM:
            blood, mucus = self._soiling(frame, force_n)
        for _ in range(steps):
            self._run_step(gap, blood, mucus)

    def skip(self, time_s: float) -> None:
        """Leave the lens as it is up to a sample's time: the trainer was frozen."""
        if self._step is not None:
            self._step = max(self._step, math.floor(time_s * STEPS_PER_S))

    def _run_step(self, gap_mm: float, blood: Doubles, mucus: Doubles) -> None:
        """Go on for one step; blood, mucus: that comes to each sector in a second."""
        dt = 1.0 / STEPS_PER_S
        inside = math.isfinite(gap_mm)
        target = (NOSE_C if inside else ROOM_C) + LIT_C
        self._lens_c += (target - self._lens_c) * dt / WARMING_S
        self._agent -= self._agent * dt / AGENT_S
        if self._left > 0:
            # what is on the lens goes evenly, the rest at the end
            self._blood = self._blood - self._blood / self._left
            self._mucus = self._mucus - self._mucus / self._left
            self._fog -= self._fog / self._left
            self._left -= 1
            self._agent = self._drops = 1.0
            self._lens_c = max(self._lens_c, NOSE_C)
            return
        cold = DEW_C - self._lens_c
        if inside and cold > 0:
            fogs = FOGS_PER_S * cold * (1.0 - self._agent) * dt
            self._fog += (1.0 - self._fog) * min(fogs, 1.0)
        else:
            self._fog -= self._fog * dt / DRIES_S
            if self._fog < 1e-4:
                self._fog = 0.0
        self._drops -= self._drops * dt / RUNS_OFF_S
        if self._drops < 0.01:
            self._drops = 0.0
        self._blood = self._blood + (1.0 - self._blood) * np.minimum(blood * dt, 1.0)
        self._mucus = self._mucus + (1.0 - self._mucus) * np.minimum(mucus * dt, 1.0)
        if inside and gap_mm < self._radius_mm:
            self.touches_s += dt

    def _gap(self, tip_mm: Doubles) -> float:
        """Return the gap around the tip, +inf outside the head."""
        volume = self._surface.distance
        matrix = volume.voxel_from_world
        place = matrix[:3, :3] @ tip_mm + matrix[:3, 3]
        top = np.array(volume.shape[::-1]) - 1
        if not (np.all(place >= 0) and np.all(place <= top)):
            return math.inf
        return -volume.at_voxel(place)

    def _soiling(self, frame: Doubles, force_n: float) -> tuple[Doubles, Doubles]:
        """Return the blood and the mucus that come to each sector in a second."""
        surface, radius = self._surface, self._radius_mm
        middle = frame[0] - BEHIND * radius * frame[3]
        places = middle + WINDOW * radius * (_ACROSS @ frame[1:3])
        depth = surface.distance.sample(places)
        matrix = surface.distance.voxel_from_world
        top = np.array(surface.distance.shape[::-1]) - 1
        voxels = np.rint(places @ matrix[:3, :3].T + matrix[:3, 3]).astype(int)
        i, j, k = np.clip(voxels, 0, top).T
        film = np.zeros(SECTORS)
        if surface.wounds is not None:
            drawn = surface.wounds.film.values
            for n in range(SECTORS):
                near = tuple(slice(max(a[n] - 1, 0), a[n] + 2) for a in (k, j, i))
                film[n] = min(float(drawn[near].max()) * FILM_UNIT_MM, THICK_MM)
        wet = 1.0 - (1.0 - DRY) * surface.skin.values[k, j, i] / 255.0
        pressed = np.clip((depth + WETS_MM) / (2.0 * WETS_MM), 0.0, 1.0)
        bathed = np.clip((depth + film + WETS_MM) / (2.0 * WETS_MM), 0.0, 1.0)
        return BLOOD_PER_S * film * bathed, SMEARS_PER_NS * force_n * wet * pressed


def _sectors(values: Doubles) -> Sectors:
    """Return shares as a state has them."""
    a, b, c, d, e, f, g, h = np.clip(values, 0.0, 1.0).tolist()
    return a, b, c, d, e, f, g, h
