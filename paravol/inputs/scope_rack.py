"""The scopes that lie ready in an exercise, and which of them is in hand."""

from collections.abc import Sequence
from dataclasses import replace

from devices import Pose
from disk import UserError
from paravol.inputs.pose_completer import PoseCompleter
from scenarios import Sample


class ScopeRack:
    """Put the scope that was chosen last into samples.

    It may be asked at any time, by any thread. A scope that a recording brings is left
    until somebody chooses.
    """

    def __init__(
        self, completer: PoseCompleter, own_deg: float, choices_deg: Sequence[float]
    ) -> None:
        """Begin with the exercise's own scope; choices_deg: angles, from the least."""
        self._completer = completer
        self._own_deg = own_deg
        self._chosen_deg: float | None = None
        self.choices_deg = tuple(choices_deg)
        self.angle_deg = own_deg
        """Of the scope in the newest sample."""

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

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with its channel and the scope in hand."""
        sample = self._completer.complete(pose)
        chosen = self._chosen_deg
        if chosen is not None:
            angle = None if chosen == self._own_deg else chosen
            sample = replace(sample, scope_deg=angle)
        angle = sample.scope_deg
        self.angle_deg = self._own_deg if angle is None else angle
        return sample
