"""The numbers that make one virtual patient."""

import hashlib

import msgspec


class PhantomParameters(msgspec.Struct, frozen=True, kw_only=True):
    """Choose one sinus phantom; equal parameters give equal volumes, bit for bit.

    Lengths are millimetres. The default head is an adult of average size with
    decongested mucosa, as it is prepared for endoscopy: with congestion 0.6 a 4 mm
    scope has to push tissue aside.

    seed: draws the ethmoid cells and the unevenness of the walls.
    septal_deviation_mm: largest sideways bend of the septum, positive to the right.
    keros_mm: depth of the olfactory fossa below the ethmoid roof.
    congestion: 0 decongested to 1 swollen turbinates.
    maxillary_scale, frontal_scale, sphenoid_scale: size factors; frontal 0 is aplasia.
    anterior_cells, posterior_cells: ethmoid cells of each side.
    cell_bone_mm: bone of the walls between ethmoid cells.
    mucosa_mm: thickness of healthy sinus mucosa.
    unevenness: factor on the natural waviness of the walls; 0 gives planes.
    uncinectomy: whether the uncinate process has been removed.
    edge_blur_mm: standard deviation of the scanner's point spread function.
    """

    seed: int = 1
    septal_deviation_mm: float = 0.6
    keros_mm: float = 5.3
    congestion: float = 0.0
    maxillary_scale: float = 0.97
    frontal_scale: float = 1.0
    sphenoid_scale: float = 1.0
    anterior_cells: int = 7
    posterior_cells: int = 4
    cell_bone_mm: float = 0.25
    mucosa_mm: float = 0.4
    unevenness: float = 1.0
    uncinectomy: bool = False
    edge_blur_mm: float = 0.35

    def __post_init__(self) -> None:
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(
                    f"phantom parameter {name} must lie in [{low}, {high}], got {value}"
                )
        if 0 < self.frontal_scale < 0.5:
            raise ValueError(
                f"phantom parameter frontal_scale must be 0 (aplasia) or in [0.5, 1.2],"
                f" got {self.frontal_scale}"
            )

    def digest(self) -> str:
        """Hash all parameters to 64 hexadecimal digits."""
        return hashlib.sha256(msgspec.json.encode(self, order="sorted")).hexdigest()


_RANGES = (
    ("seed", 0, 2**63 - 1),
    ("septal_deviation_mm", -6.0, 6.0),
    ("keros_mm", 1.0, 12.0),
    ("congestion", 0.0, 1.0),
    ("maxillary_scale", 0.6, 1.1),
    ("frontal_scale", 0.0, 1.2),
    ("sphenoid_scale", 0.7, 1.1),
    ("anterior_cells", 5, 9),
    ("posterior_cells", 3, 6),
    ("cell_bone_mm", 0.1, 0.5),
    ("mucosa_mm", 0.2, 0.6),
    ("unevenness", 0.0, 1.5),
    ("edge_blur_mm", 0.1, 1.0),
)
