"""The tissues of the head: their numbers, labels and looks.

HU are means of published ranges; blood volume fractions give, through haemoglobin
absorption, the chromaticity measured on healthy inferior turbinates.
"""

from enum import IntEnum
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from anatomy.table_file import read_table


class Label(IntEnum):
    """Name the values of the label volume."""

    OUTSIDE_AIR = 0
    NASAL_AIR = 1
    NASOPHARYNX_AIR = 2
    MAXILLARY_AIR = 3
    FRONTAL_AIR = 4
    ANTERIOR_ETHMOID_AIR = 5
    POSTERIOR_ETHMOID_AIR = 6
    SPHENOID_AIR = 7
    VARIANT_CELL_AIR = 8
    UNNAMED_AIR = 9
    MUCOSA = 10
    INFERIOR_TURBINATE = 11
    MIDDLE_TURBINATE = 12
    SUPERIOR_TURBINATE = 13
    SEPTAL_CARTILAGE = 14
    POLYP = 15
    MUCUS = 16
    INSPISSATED_MUCUS = 17
    THICK_BONE = 20
    SEPTAL_BONE = 21
    LAMINA_PAPYRACEA = 22
    ETHMOID_SEPTUM = 23
    BASAL_LAMELLA = 24
    UNCINATE = 25
    CRIBRIFORM = 26
    FOVEA = 27
    TURBINATE_BONE = 28
    SPHENOID_WALL = 29
    TEETH = 30
    FAT = 40
    MUSCLE = 41
    SKIN = 42
    PTERYGOPALATINE_FOSSA = 43
    ORBITAL_FISSURE = 44
    GLOBE = 50
    LENS = 51
    OPTIC_NERVE = 52
    EXTRAOCULAR_MUSCLE = 53
    BRAIN = 60
    DURA = 61
    CSF = 62
    INTERNAL_CAROTID = 70
    ETHMOIDAL_ARTERY = 71
    SPHENOPALATINE_ARTERY = 72
    NASOLACRIMAL_DUCT = 73
    VIDIAN_NERVE = 74
    MAXILLARY_NERVE = 75


class Side(IntEnum):
    """Name the values of the side volume."""

    MIDLINE = 0
    RIGHT = 1
    LEFT = 2


AIR_LABELS = frozenset(label for label in Label if label < Label.MUCOSA)


LIVE_OVER_CADAVER = 1.5
"""Factor on forces measured in cadavers; curettes took 6.4 N in cadavers and 9.6 N in
patients (Joice 2012)."""


class Tissue(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Describe one tissue, as ``tissues.toml`` has it.

    hu: mean CT number. t1, t2: MR signal, relative to fat on T1 and to CSF on T2.
    blood_fraction: healthy blood volume. stiffness_n_mm: resistance to a blunt tip of
    2 mm. cadaver_n: axial force at which a thin wall broke in cadavers, 0 where nothing
    breaks. friction: Coulomb's, of soft tissue against a tool. labels: as `Label`
    names them.
    """

    hu: float
    blood_fraction: float
    t1: float
    t2: float
    stiffness_n_mm: float
    cadaver_n: float = 0.0
    measured_by: Literal["", "punch", "curette"] = ""
    friction: float = 0.1
    labels: tuple[str, ...] = ()

    @property
    def fracture_n(self) -> float:
        """Return the axial force at which a thin wall breaks, N; 0 where none does."""
        return self.cadaver_n * LIVE_OVER_CADAVER


TISSUES = read_table(__file__, "tissues.toml", dict[str, Tissue])

TISSUE_OF = {
    Label[label]: tissue for tissue in TISSUES.values() for label in tissue.labels
}
"""The tissue behind every label."""

TISSUE_NAMES: dict[int, str] = {
    Label[label]: name for name, tissue in TISSUES.items() for label in tissue.labels
}

SURFACE_HU = -480.0
"""Half-way between air and mucosa: there alone the surface does not move with the
scanner's blur."""

HIGHEST_BLOOD_FRACTION = 1.0


def encode_blood(fraction: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Store blood fractions as ``v`` with ``fraction = (v / 255)^2``.

    The square root puts more steps where pale tissues differ.
    """
    root = np.sqrt(np.clip(fraction, 0.0, HIGHEST_BLOOD_FRACTION))
    return np.floor(255 * root + 0.5).astype(np.uint8)
