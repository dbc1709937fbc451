"""How clean the front lens of the scope is."""

import math
from dataclasses import dataclass

from system import UserError

SECTORS = 8
"""Parts of the lens that get dirty each for itself, like slices of a cake. The first
has its middle on the right of the picture, the third above."""

Sectors = tuple[float, float, float, float, float, float, float, float]


def all_over(share: float) -> Sectors:
    """Return the same in every sector."""
    return share, share, share, share, share, share, share, share


NONE = all_over(0.0)


@dataclass(frozen=True, slots=True)
class LensState:
    """What lies on the front lens; a clean one changes no bit of a picture.

    blood, mucus: share of each sector that they cover, 0 to 1, from the rim inwards.
    fog: how dense the condensed water is, 0 to 1. drops: of water, 1 for as many as
    stay on a lens. seed: where all of it lies; another one after each wash.
    """

    blood: Sectors = NONE
    mucus: Sectors = NONE
    fog: float = 0.0
    drops: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("blood", "mucus"):
            values = getattr(self, name)
            if len(values) != SECTORS:
                raise UserError(f"a lens has {SECTORS} sectors of {name}: {values}")
            for value in values:
                _require_share(name, value)
        _require_share("fog", self.fog)
        _require_share("drops", self.drops)

    @property
    def soil(self) -> float:
        """Return the share of the lens that blood and mucus cover."""
        return sum(map(max, self.blood, self.mucus)) / SECTORS

    @property
    def is_clean(self) -> bool:
        """Return whether nothing lies on the lens."""
        return self.soil == self.fog == self.drops == 0


def _require_share(name: str, value: float) -> None:
    if not (math.isfinite(value) and 0 <= value <= 1):
        raise UserError(f"a lens has {name} within 0..1, got {value}")


CLEAN = LensState()
