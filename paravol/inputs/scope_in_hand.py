"""The scope in hand: which one, how its light post and its camera head are turned."""

import math
from collections.abc import Sequence
from dataclasses import replace

from scenarios import Sample
from system import UserError


class ScopeInHand:
    """Put the scope that was chosen last into samples, and how a hand turned it.

    All may be changed at any time, by any thread. A scope that a recording brings is
    left until somebody chooses. post_deg: turn of the light post, on top of what the
    channel says. camera_deg: of the camera head, from upright; one that follows the
    post goes along with it, as in a hand that turns both. angle_deg: of the scope in
    the newest sample.
    """

    def __init__(
        self,
        own_deg: float = 0.0,
        choices_deg: Sequence[float] = (),
        *,
        follows_post: bool = False,
        camera_deg: float = 0.0,
    ) -> None:
        """Begin with the exercise's own scope; choices_deg: angles, from the least."""
        self._own_deg = self.angle_deg = own_deg
        self._chosen_deg: float | None = None
        self.choices_deg = tuple(choices_deg)
        self.post_deg = 0.0
        self.camera_deg = camera_deg
        self._follows_post = follows_post
        self._first_deg: float | None = None

    def choose(self, angle_deg: float) -> None:
        """Put in the scope of an angle; UserError where the exercise has none."""
        if angle_deg not in self.choices_deg:
            there = ", ".join(f"{choice:g}°" for choice in self.choices_deg)
            raise UserError(
                f"The exercise has no scope of {angle_deg:g}°; it has {there}."
            )
        self._chosen_deg = angle_deg

    def step(self, by: int) -> float:
        """Put in the scope that lies so many places on, and return its angle."""
        now = self.angle_deg if self._chosen_deg is None else self._chosen_deg
        choices = self.choices_deg
        place = choices.index(now) if now in choices else 0
        self._chosen_deg = choices[(place + by) % len(choices)]
        return self._chosen_deg

    def turn(self, sample: Sample) -> Sample:
        """Return the sample with the scope in hand, and its turns added."""
        roll_deg = sample.roll_deg + self.post_deg
        if self._first_deg is None:
            self._first_deg = roll_deg
        camera_deg = sample.camera_roll_deg + self.camera_deg
        if self._follows_post:
            camera_deg += roll_deg - self._first_deg
        if not -180.0 <= camera_deg <= 180.0:
            camera_deg = math.remainder(camera_deg, 360.0)
        angle = sample.scope_deg
        if self._chosen_deg is not None:
            angle = None if self._chosen_deg == self._own_deg else self._chosen_deg
        self.angle_deg = self._own_deg if angle is None else angle
        return replace(
            sample, roll_deg=roll_deg, camera_roll_deg=camera_deg, scope_deg=angle
        )
