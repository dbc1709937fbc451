"""What gets on the front lens of the scope: blood, mucus, water; and how it is washed.

All follows from the samples, in fixed steps of their time. Design figures: a cold lens
fogs within some ten seconds in a warm nose, a warm one hardly does; a touch of blood
hides a third of the picture at once; washing takes two seconds.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from disk import UserError
from renderers.scene import AirSurface
from renderers.scene.lens_state import LensState
from renderers.scene.scene import FILM_UNIT_MM
from surgery.film import STEPS_PER_S

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

SMEARS_PER_S = 0.35
"""Soil that wet tissue leaves in a second of touch; mucus only."""

BLOOD_PER_S = 6.0
"""That of blood, per mm of its thickness, thickest `THICK_MM`."""
THICK_MM = 0.5


@dataclass(frozen=True, slots=True)
class LensFreeze:
    """Hold what is on a lens, how warm it is and what was counted, see `Lens`."""

    soil: float
    fog: float
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
        self._soil = self._fog = self._agent = 0.0
        self._lens_c = start_c
        self._step: int | None = None
        self._left = 0
        self.touches_s = 0.0
        self.washes = 0

    @property
    def state(self) -> LensState:
        """Return what lies on the lens now."""
        return LensState(self._soil, self._fog, self.washes)

    def freeze(self) -> LensFreeze:
        """Return all that later samples may change."""
        return LensFreeze(
            self._soil,
            self._fog,
            self._agent,
            self._lens_c,
            self._step,
            self._left,
            self.touches_s,
            self.washes,
        )

    def restore(self, state: LensFreeze) -> None:
        """Make the lens what it was."""
        self._soil, self._fog, self._agent = state.soil, state.fog, state.agent
        self._lens_c, self._step, self._left = state.lens_c, state.step, state.left
        self.touches_s, self.washes = state.touches_s, state.washes

    def wash(self) -> None:
        """Begin to wash, at the pedal or key; nothing where that goes on already."""
        if self._left == 0:
            self._left = round(WASH_S * STEPS_PER_S)
            self.washes += 1

    def advance(self, time_s: float, tip_mm: NDArray[np.float64]) -> None:
        """Follow the scope to a sample's time; the first call sets the beginning.

        tip_mm: ``(3,)`` LPS, of that sample: where the lens was since the last one. One
        that is not finite counts as outside.
        """
        if not math.isfinite(time_s):
            raise UserError(f"a sample's time is finite, got {time_s} s")
        last = math.floor(time_s * STEPS_PER_S)
        steps = 0 if self._step is None else max(last - self._step, 0)
        self._step = last if self._step is None else max(last, self._step)
        if steps == 0:
            return
        gap, film = self._around(tip_mm)
        for _ in range(steps):
            self._run_step(gap, film)

    def skip(self, time_s: float) -> None:
        """Leave the lens as it is up to a sample's time: the trainer was frozen."""
        if self._step is not None:
            self._step = max(self._step, math.floor(time_s * STEPS_PER_S))

    def _run_step(self, gap_mm: float, film_mm: float) -> None:
        dt = 1.0 / STEPS_PER_S
        inside = math.isfinite(gap_mm)
        target = (NOSE_C if inside else ROOM_C) + LIT_C
        self._lens_c += (target - self._lens_c) * dt / WARMING_S
        self._agent -= self._agent * dt / AGENT_S
        if self._left > 0:
            # what is on the lens goes evenly, the rest at the end
            self._soil -= self._soil / self._left
            self._fog -= self._fog / self._left
            self._left -= 1
            self._agent = 1.0
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
        if inside and gap_mm < self._radius_mm:
            self.touches_s += dt
            soils = SMEARS_PER_S + BLOOD_PER_S * min(film_mm, THICK_MM)
            self._soil += (1.0 - self._soil) * soils * dt

    def _around(self, tip_mm: NDArray[np.float64]) -> tuple[float, float]:
        """Return the gap around the tip, +inf outside the head, and the film there."""
        volume = self._surface.distance
        matrix = volume.voxel_from_world
        place = matrix[:3, :3] @ tip_mm + matrix[:3, 3]
        top = np.array(volume.shape[::-1]) - 1
        if not (np.all(place >= 0) and np.all(place <= top)):
            return math.inf, 0.0
        gap = -volume.at_voxel(place)
        wounds = self._surface.wounds
        if wounds is None or gap >= self._radius_mm:
            return gap, 0.0
        reach = self._radius_mm / volume.spacing_mm
        low = np.maximum(np.floor(place - reach), 0).astype(int)
        high = np.minimum(np.ceil(place + reach), top).astype(int)
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        return gap, float(wounds.film.values[here].max()) * FILM_UNIT_MM
