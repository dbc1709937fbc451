"""Straight lines through a nostril, which is wide and soft, to a place behind it.

Surgeons lift the tip of the nose with a scope and lean it wherever the way behind lies
straight: no passage but the floor's runs on from the nostril's middle.
"""

import math

import numpy as np
from numpy.typing import NDArray

from devices.controls.fulcrum import Fulcrum
from renderers.scene import Volume

Doubles = NDArray[np.float64]

BACK_MM = np.concatenate([np.arange(3.0, 15.0, 1.5), np.arange(15.0, 120.0, 4.0)])
"""Where a line is looked at, from its end: the end itself may lie at tissue."""

TIP_MM = 6.0
"""So much of a scope slides along what it meets: leant against it, it would stand on
it."""

ROUND = 8
"""Places on a ring about the nostril's middle."""

LEAN_MM, RINGS = 7.5, 3
"""How far a scope's shaft may be off the nostril's middle: the phantom's is 9 mm high,
and cartilage about it yields."""

ROOM_MM = 0.2
"""More air than this about a scope is not better."""

BETTER_MM = 0.15
"""A line with so much more air is worth a change."""

EVEN = 0.02
"""What a line is off the nostril's middle counts as so much less air."""

OUTSIDE_MM = 5.0
"""So far before the nostril lip and tip of the nose are looked at, too."""

AGAIN_MM = 0.5
"""A tip that has moved by so much has its line looked for anew."""


class NostrilLines:
    """The places of a nostril where shafts may pass.

    places_mm: ``(n, 3)`` the middle, then rings about it. off: ``(n, 3)`` off it.
    """

    def __init__(
        self,
        fulcrum: Fulcrum,
        distance: Volume,
        most_mm: float,
        rings: int,
        end_mm: float = 0.0,
    ) -> None:
        """Take the nostril, and how far off its middle shafts may pass.

        distance: signed air distance of the head, mm, read as it is at the time.
        end_mm: so much of a line's end is not looked at.
        """
        self._distance = distance
        self._back_mm = BACK_MM[end_mm <= BACK_MM]
        right = np.cross(fulcrum.axis, fulcrum.up)
        right /= np.linalg.norm(right)
        up = np.cross(right, fulcrum.axis)
        turns = np.arange(ROUND) * (2.0 * math.pi / ROUND)
        radii = most_mm * np.arange(1, rings + 1) / rings
        about = np.outer(np.cos(turns), right) + np.outer(np.sin(turns), up)
        off = (radii[:, None, None] * about).reshape(-1, 3)
        self.off: Doubles = np.vstack([np.zeros(3), off])
        self.middle_mm = fulcrum.pivot_mm
        self.places_mm: Doubles = fulcrum.pivot_mm + self.off

    def points(
        self,
        places_mm: Doubles,
        ends_mm: Doubles,
        outside_mm: float = 0.0,
        *,
        is_whole: bool = False,
    ) -> Doubles:
        """Return points of the lines from places to their ends, ``(n, m, 3)``.

        places_mm, ends_mm: ``(n, 3)``, or one end for all. outside_mm: they run on so
        far before the places. is_whole: each as far as it is long, all as far as the
        shortest else.
        """
        ways = ends_mm - places_mm
        lengths = np.linalg.norm(ways, axis=1, keepdims=True)
        most_mm = lengths if is_whole else lengths.min()
        back_mm = np.minimum(self._back_mm, most_mm + outside_mm)
        share = 1.0 - back_mm / np.maximum(lengths, 1e-9)
        found: Doubles = places_mm[:, None] + share[..., None] * ways[:, None]
        return found

    def lacks_mm(self, points: Doubles, needed_mm: float) -> Doubles:
        """Return how much air each point lacks, ``(n, m)``; 0 where there is enough."""
        air = -self._distance.sample(points.reshape(-1, 3)).reshape(points.shape[:2])
        return np.maximum(needed_mm - air, 0.0)


class LeaningScope:
    """Choose where in the nostril a hand lays a scope whose tip is at a place."""

    def __init__(self, fulcrum: Fulcrum, distance: Volume, radius_mm: float) -> None:
        """Begin in the middle. distance: as of `NostrilLines`."""
        self._lines = NostrilLines(fulcrum, distance, LEAN_MM, RINGS, TIP_MM)
        self._needed_mm = radius_mm + ROOM_MM
        self._best = fulcrum.pivot_mm
        self._looked_at: Doubles | None = None

    def __call__(self, tip_mm: Doubles) -> Doubles:
        """Return the place in the nostril, ``(3,)``, for a tip."""
        seen = self._looked_at
        if seen is not None and float(np.linalg.norm(tip_mm - seen)) < AGAIN_MM:
            return self._best
        self._looked_at = tip_mm
        lines = self._lines
        places = np.vstack([self._best, lines.places_mm])
        points = lines.points(places, tip_mm, OUTSIDE_MM)
        lacks = lines.lacks_mm(points, self._needed_mm)
        worth = -lacks.max(axis=1) - 2.0 * lacks.mean(axis=1)
        worth -= EVEN * np.linalg.norm(places - lines.middle_mm, axis=1)
        best = int(np.argmax(worth))
        if worth[best] > worth[0] + BETTER_MM:
            self._best = places[best]
        return self._best
