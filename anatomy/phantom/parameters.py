"""The numbers that make one virtual patient."""

import hashlib
from typing import Literal

import msgspec

from anatomy.tissue import Side
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
        """Return the side's Lund-Mackay score, 0 to 12."""
        return sum(getattr(self, name) for name in (*SINUSES, "ostiomeatal"))


USUAL = tuple(
    f"{name}:{side}"
    for name in ("agger-nasi", "retrobulbar-recess", "suprabullar-cell")
    for side in ("left", "right")
)
"""Cells that most sides have."""

SINUS_NAMES = Literal["maxillary", "frontal", "sphenoid", "ethmoid"]


_WIDEST_RATIO = {"keros": 12.0}


class LeftRatios(msgspec.Struct, frozen=True, kw_only=True):
    """Tell how much larger the left sinuses are than the right ones.

    keros: how much deeper the left olfactory fossa is.
    """

    maxillary: float = 1.0
    frontal: float = 1.0
    sphenoid: float = 1.0
    ethmoid: float = 1.0
    keros: float = 1.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if not 0.0 <= value <= _WIDEST_RATIO.get(name, 3.0):
                what = "olfactory fossa" if name == "keros" else f"{name} sinus"
                raise UserError(
                    f"the left ratio of the {what} must lie in "
                    f"[0, {_WIDEST_RATIO.get(name, 3.0):g}], got {value}"
                )


class PhantomParameters(msgspec.Struct, frozen=True, kw_only=True):
    """Choose one sinus phantom; equal parameters give equal volumes, bit for bit.

    Lengths are millimetres. The default head is an adult of average size with
    decongested mucosa, as it is prepared for endoscopy: with congestion 0.6 a 4 mm
    scope has to push tissue aside.

    seed: draws the ethmoid cells, the outlines of the sinuses and the unevenness of
    the walls.
    head_scale: size of the whole head; sex and stature move it.
    septal_deviation_mm: largest sideways bend of the septum, positive to the right.
    roof_mm: height of the ethmoid's roof above the average.
    keros_mm: depth of the right olfactory fossa below the ethmoid roof.
    congestion: 0 decongested to 1 swollen turbinates.
    maxillary_scale, frontal_scale, sphenoid_scale: size factors; frontal 0 is aplasia.
    ethmoid_scale: width factor of the ethmoid block.
    left: ratios of the left sinuses' factors, and of the left fossa's depth, to the
    right ones'.
    anterior_cells, posterior_cells: ethmoid cells of each side.
    cell_bone_mm: bone of the walls between ethmoid cells.
    mucosa_mm: thickness of healthy sinus mucosa.
    unevenness: factor on the natural waviness of the walls; 0 gives planes.
    uncinectomy: whether the uncinate process has been removed.
    variants: names such as ``"onodi:left"``, see `anatomy.phantom.variants`.
    opacity: what disease fills, see `Opacity`.
    edge_blur_mm: standard deviation of the scanner's point spread function.
    ct_noise_hu: standard deviation of the CT's noise; 12 is a soft kernel, 50 a bone
    kernel.
    """

    seed: int = 1
    head_scale: float = 1.0
    septal_deviation_mm: float = 0.6
    roof_mm: float = 0.0
    keros_mm: float = 5.3
    congestion: float = 0.0
    maxillary_scale: float = 0.97
    frontal_scale: float = 1.0
    sphenoid_scale: float = 1.0
    ethmoid_scale: float = 1.0
    left: LeftRatios = LeftRatios()
    anterior_cells: int = 7
    posterior_cells: int = 4
    cell_bone_mm: float = 0.25
    mucosa_mm: float = 0.4
    unevenness: float = 1.0
    uncinectomy: bool = False
    variants: tuple[str, ...] = USUAL
    opacity: tuple[Opacity, Opacity] = (Opacity(), Opacity())
    edge_blur_mm: float = 0.35
    ct_noise_hu: float = 0.0

    def __post_init__(self) -> None:
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if not low <= value <= high:
                raise UserError(
                    f"phantom parameter {name} must lie in [{low}, {high}], got {value}"
                )
        if 0 < self.frontal_scale < 0.5:
            raise UserError(
                f"phantom parameter frontal_scale must be 0 (aplasia) or in "
                f"[0.5, 1.35], got {self.frontal_scale}"
            )
        known = [f"{n}:{s}" for n in SIDED_VARIANTS for s in ("left", "right")]
        for variant in self.variants:
            if variant not in known:
                raise UserError(
                    f"there is no variant {variant!r}; the names are "
                    f"{', '.join(SIDED_VARIANTS)}, each with :left or :right"
                )
        if tuple(sorted(set(self.variants))) != self.variants:
            raise UserError(
                f"variants must be sorted and named once, got {self.variants}"
            )

    def digest(self) -> str:
        """Hash all parameters to 64 hexadecimal digits."""
        return hashlib.sha256(msgspec.json.encode(self, order="sorted")).hexdigest()

    def has(self, variant: str, side: Side) -> bool:
        """Return whether a side has a variant; name it without the side."""
        return f"{variant}:{side.name.lower()}" in self.variants

    def scale(self, sinus: SINUS_NAMES, side: Side) -> float:
        """Return a sinus's size factor on one side, within what the model can carry."""
        value = float(getattr(self, f"{sinus}_scale"))
        if side == Side.LEFT:
            value *= float(getattr(self.left, sinus))
        low, high = _SIDE_RANGES[sinus]
        if sinus == "frontal" and value < 0.25:
            return 0.0
        return min(max(value, low), high)

    def keros(self, side: Side) -> float:
        """Return the depth of one side's olfactory fossa, mm, within [1, 12]."""
        depth = self.keros_mm * (self.left.keros if side == Side.LEFT else 1.0)
        return min(max(depth, 1.0), 12.0)

    def opacity_of(self, side: Side) -> Opacity:
        """Return the disease of one side."""
        return self.opacity[0 if side == Side.RIGHT else 1]


SIDED_VARIANTS = (
    "agger-nasi",
    "concha-bullosa",
    "dehiscent-carotid",
    "dehiscent-optic",
    "haller",
    "hanging-artery",
    "onodi",
    "paradoxical-turbinate",
    "septal-spur",
    "accessory-ostium",
    "frontal-septal-cell",
    "retrobulbar-recess",
    "supraorbital-cell",
    "suprabullar-cell",
)
"""Variants of anatomy that a side has or has not."""

_RANGES = (
    ("seed", 0, 2**63 - 1),
    ("head_scale", 0.9, 1.08),
    ("septal_deviation_mm", -6.0, 6.0),
    ("keros_mm", 1.0, 12.0),
    ("congestion", 0.0, 1.0),
    ("maxillary_scale", 0.6, 1.1),
    ("frontal_scale", 0.0, 1.35),
    ("sphenoid_scale", 0.7, 1.1),
    ("roof_mm", -3.5, 3.5),
    ("ethmoid_scale", 0.7, 1.3),
    ("anterior_cells", 5, 9),
    ("posterior_cells", 3, 6),
    ("cell_bone_mm", 0.1, 0.5),
    ("mucosa_mm", 0.2, 0.6),
    ("unevenness", 0.0, 1.5),
    ("edge_blur_mm", 0.1, 1.0),
    ("ct_noise_hu", 0.0, 200.0),
)
_SIDE_RANGES = {
    "maxillary": (0.6, 1.1),
    "frontal": (0.5, 1.35),
    "sphenoid": (0.7, 1.15),
    "ethmoid": (0.7, 1.3),
}
