"""How clean the front lens of the scope is."""

import math
from dataclasses import dataclass

from disk import UserError


@dataclass(frozen=True, slots=True)
class LensState:
    """Say what lies on the front lens; a clean one changes no bit of a picture.

    soil: share of the lens that blood and mucus cover, 0 to 1. fog: how dense the
    condensed water is, 0 to 1. seed: where the soil lies; another one after each wash.
    """

    soil: float = 0.0
    fog: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value in (("soil", self.soil), ("fog", self.fog)):
            if not (math.isfinite(value) and 0 <= value <= 1):
                raise UserError(f"a lens has {name} within 0..1, got {value}")

    @property
    def is_clean(self) -> bool:
        """Return whether nothing lies on the lens."""
        return self.soil == 0 and self.fog == 0


CLEAN = LensState()
