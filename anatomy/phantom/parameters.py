"""The numbers that make one virtual patient."""

import hashlib
from typing import Literal

import msgspec

from anatomy.table_file import read_table
from anatomy.tissue import Side
from system import UserError


class Sizes(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A sinus's volume, mean and deviation, and the volumes of size factors."""

    ml: tuple[float, float]
    factors: tuple[float, ...]
    volumes_ml: tuple[float, ...]


class _Patients(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``patients.toml``."""

    ranges: dict[str, tuple[int | float, int | float]]
    side_ranges: dict[str, tuple[float, float]]
    findings: dict[str, tuple[float, float, str]]
    prevalence: dict[str, float]
    sizes: dict[str, Sizes]
    sphenoids: dict[str, Sizes]


PATIENTS = read_table(__file__, "patients.toml", _Patients)

SIDED_VARIANTS = tuple(PATIENTS.prevalence)
"""Variants of anatomy that a side has or has not."""

SINUSES = (
    "maxillary",
    "anterior_ethmoid",
    "posterior_ethmoid",
    "sphenoid",
    "frontal",
)


class Opacity(msgspec.Struct, frozen=True, kw_only=True):
    """The Lund-Mackay scores of one side, and the polyps' grade.

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


FLUID_SINUSES = ("maxillary", "sphenoid", "frontal")
"""Sinuses of one space: fluid has a level in them, and a cyst room."""

FindingKind = Literal["swelling", "fluid", "cyst"]


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """Name one thing that disease has put into one sinus.

    size: thickness of the swollen lining in mm, share of the sinus's volume under the
    fluid, or radius of the retention cyst in mm.
    """

    kind: FindingKind
    sinus: str
    side: Literal["left", "right"]
    size: float

    def __post_init__(self) -> None:
        allowed = SINUSES if self.kind == "swelling" else FLUID_SINUSES
        if self.sinus not in allowed:
            raise UserError(
                f"{self.kind} is found in {', '.join(allowed)}, not in {self.sinus!r}"
            )
        low, high, what = PATIENTS.findings[self.kind]
        if "ethmoid" in self.sinus:
            high = 1.2
        if not low <= self.size <= high:
            raise UserError(
                f"the size of {self.kind} in the {self.sinus} sinus, its {what}, must "
                f"lie in [{low}, {high}], got {self.size}"
            )


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
    spread_mm: standard deviation of places against the average head's, along an axis
    and far from the anterior nasal spine; drawn by the seed.
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
    uncinectomy: whether the uncinate processes have been removed.
    antrostomy_mm2: area of the opening that surgery has left between middle meatus and
    maxillary sinus, right and left; 0 for none. It takes the uncinate process along.
    findings: what disease did to single sinuses, in place of what their score draws.
    posture: how the head lay when it was scanned, which sets where fluid gathers.
    variants: names such as ``"onodi:left"``, see `anatomy.phantom.variants`.
    opacity: what disease fills, see `Opacity`.
    edge_blur_mm: standard deviation of the scanner's point spread function.
    ct_noise_hu: standard deviation of the CT's noise; 12 is a soft kernel, 50 a bone
    kernel.
    """

    seed: int = 1
    head_scale: float = 1.0
    spread_mm: float = 0.0
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
    antrostomy_mm2: tuple[float, float] = (0.0, 0.0)
    variants: tuple[str, ...] = USUAL
    opacity: tuple[Opacity, Opacity] = (Opacity(), Opacity())
    findings: tuple[Finding, ...] = ()
    posture: Literal["supine", "upright"] = "supine"
    edge_blur_mm: float = 0.35
    ct_noise_hu: float = 0.0

    def __post_init__(self) -> None:
        for name, (low, high) in PATIENTS.ranges.items():
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
        low, high = ANTROSTOMY_MM2
        for area in self.antrostomy_mm2:
            if area != 0.0 and not low <= area <= high:
                raise UserError(
                    f"the area of an antrostomy must be 0 or lie in [{low}, {high}] "
                    f"mm^2, got {area}"
                )
        sites = [(f.kind, f.sinus, f.side) for f in self.findings]
        if len(set(sites)) < len(sites):
            raise UserError("a finding can be named once for each sinus and side")
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

        for side in (Side.RIGHT, Side.LEFT):
            for group in EXCLUSIVE:
                held = [name for name in group if self.has(name, side)]
                if len(held) > 1:
                    raise UserError(
                        f"{' and '.join(held)} exclude each other; both are given for "
                        f"the {side.name.lower()} side"
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
        low, high = PATIENTS.side_ranges[sinus]
        if sinus == "frontal" and value < 0.25:
            return 0.0
        return min(max(value, low), high)

    def is_operated(self, side: Side) -> bool:
        """Return whether surgery has taken the uncinate process of one side."""
        return self.uncinectomy or self.antrostomy_of(side) > 0.0

    def antrostomy_of(self, side: Side) -> float:
        """Return the area of one side's antrostomy, mm^2."""
        return self.antrostomy_mm2[0 if side == Side.RIGHT else 1]

    def findings_in(self, sinus: str, side: Side) -> tuple[Finding, ...]:
        """Return what disease did to one sinus."""
        where = sinus, side.name.lower()
        return tuple(f for f in self.findings if (f.sinus, f.side) == where)

    def keros(self, side: Side) -> float:
        """Return the depth of one side's olfactory fossa, mm, within [1, 12]."""
        depth = self.keros_mm * (self.left.keros if side == Side.LEFT else 1.0)
        return min(max(depth, 1.0), 12.0)

    def opacity_of(self, side: Side) -> Opacity:
        """Return the disease of one side."""
        return self.opacity[0 if side == Side.RIGHT else 1]


SPHENOID_KINDS = ("conchal-sphenoid", "presellar-sphenoid", "postsellar-sphenoid")
"""Variants of the sphenoid's pneumatization that exclude each other; without one it is
sellar."""

ANTROSTOMY_MM2 = 20.0, 140.0
"""Areas that an antrostomy can have: that of a natural ostium and more, up to the space
between the orbit's floor and the inferior turbinate."""

UNCINATE_ENDS = ("uncinate-cribriform", "uncinate-skull-base", "uncinate-turbinate")
"""Variants of the uncinate process's upper end that exclude each other; without one it
reaches the lamina papyracea."""

EXCLUSIVE = (
    SPHENOID_KINDS,
    UNCINATE_ENDS,
    ("conchal-sphenoid", "lateral-recess"),
    ("medialised-turbinate", "lateralised-turbinate", "concha-bullosa"),
)
"""Groups of variants of which a side has one at most; a conchal sinus has no recess,
and a turbinate full of air leaves no room beside the septum."""
