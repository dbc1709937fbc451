"""What disease leaves of the air of one side, as the Lund-Mackay score counts it."""

import msgspec

from disk import UserError

SINUSES = (
    "maxillary",
    "anterior_ethmoid",
    "posterior_ethmoid",
    "sphenoid",
    "frontal",
)


class Opacity(msgspec.Struct, frozen=True, kw_only=True):
    """Hold the Lund-Mackay scores of one side, and the polyps' grade.

    A sinus is 0 (clear), 1 (partly opaque) or 2 (without air); the ostiomeatal complex
    is 0 (open) or 2 (blocked). polyps: 0 none; 1 within the middle meatus; 2 below the
    middle turbinate; 3 down to the lower edge of the inferior turbinate; 4 filling the
    lower cavity.
    """

    maxillary: int = 0
    anterior_ethmoid: int = 0
    posterior_ethmoid: int = 0
    sphenoid: int = 0
    frontal: int = 0
    ostiomeatal: int = 0
    polyps: int = 0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            allowed = {"ostiomeatal": (0, 2), "polyps": (0, 1, 2, 3, 4)}.get(
                name, (0, 1, 2)
            )
            value = getattr(self, name)
            if value not in allowed:
                raise UserError(
                    f"the score of {name} must be one of {allowed}, got {value}"
                )

    @property
    def total(self) -> int:
        """Get the side's Lund-Mackay score, 0 to 12."""
        return sum(getattr(self, name) for name in (*SINUSES, "ostiomeatal"))
