"""The tissues of the head: their numbers, labels and looks.

HU are means of published ranges; blood volume fractions give, through haemoglobin
absorption, the chromaticity measured on healthy inferior turbinates.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


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


@dataclass(frozen=True, slots=True)
class Tissue:
    """Describe one tissue.

    hu: mean CT number. t1, t2: MR signal, relative to fat on T1 and to CSF on T2.
    blood_fraction: healthy blood volume. stiffness_n_mm: resistance to a blunt tip of
    2 mm. fracture_n: axial force at which a thin wall breaks, 0 where nothing breaks.
    """

    hu: float
    blood_fraction: float
    t1: float = 0.4
    t2: float = 0.5
    stiffness_n_mm: float = 0.5
    fracture_n: float = 0.0


LIVE_OVER_CADAVER = 1.5
"""Factor on forces measured in cadavers; curettes took 6.4 N in cadavers and 9.6 N in
patients (Joice 2012)."""

# Thin walls: cadaver punch forces of Am J Rhinol Allergy 2010 (24.3374): lamellae
# 6.06 N, lamina papyracea 6.13 N, skull base 17.8 N, carotid and optic crests 13.2 and
# 15.4 N. HU are means of published ranges; MR weights of spin-echo images and
# stiffnesses are set by order of magnitude.
_PUNCH = LIVE_OVER_CADAVER
TISSUES: dict[str, Tissue] = {
    "air": Tissue(-1000.0, 0.0, 0.0, 0.0, 0.0),
    "mucosa": Tissue(40.0, 0.11, 0.40, 0.75, 0.3),
    "septum": Tissue(40.0, 0.085, 0.40, 0.70, 1.5),
    "inferior turbinate": Tissue(45.0, 0.15, 0.40, 0.80, 0.6),
    "middle turbinate": Tissue(45.0, 0.12, 0.40, 0.75, 0.6),
    "superior turbinate": Tissue(45.0, 0.10, 0.40, 0.75, 0.6),
    "uncinate": Tissue(40.0, 0.10, 0.40, 0.75, 1.0, 6.4 * _PUNCH),
    "torus": Tissue(60.0, 0.075, 0.40, 0.65, 1.0),
    "nasopharynx": Tissue(40.0, 0.08, 0.40, 0.70, 0.4),
    "sinus lining": Tissue(40.0, 0.045, 0.40, 0.75, 0.3),
    "polyp": Tissue(25.0, 0.006, 0.35, 0.90, 0.1),
    "mucus": Tissue(15.0, 0.0, 0.20, 1.00, 0.02),
    "inspissated mucus": Tissue(100.0, 0.0, 0.55, 0.08, 0.05),
    "cartilage": Tissue(100.0, 0.05, 0.35, 0.30, 1.5),
    "thin bone": Tissue(1500.0, 0.003, 0.03, 0.03, 3.0, 6.06 * _PUNCH),
    # it hangs free: 3 E I / L^3 of a plate 15 mm long and wide and 0.4 to 0.6 mm thick,
    # of 5 GPa, is 0.4 to 1.2 N/mm
    "turbinate bone": Tissue(1500.0, 0.003, 0.03, 0.03, 1.0, 6.06 * _PUNCH),
    "lamina papyracea": Tissue(1500.0, 0.003, 0.03, 0.03, 3.0, 6.13 * _PUNCH),
    "skull base": Tissue(1500.0, 0.003, 0.03, 0.03, 6.0, 17.8 * _PUNCH),
    "sphenoid canal": Tissue(1500.0, 0.003, 0.03, 0.03, 5.0, 13.2 * _PUNCH),
    "bone": Tissue(1100.0, 0.003, 0.03, 0.03, 20.0),
    "cancellous bone": Tissue(500.0, 0.003, 0.55, 0.35, 20.0),
    "tooth": Tissue(2200.0, 0.0, 0.0, 0.0, 20.0),
    "fat": Tissue(-90.0, 0.02, 1.00, 0.70, 0.1),
    "muscle": Tissue(50.0, 0.05, 0.35, 0.22, 0.4),
    "skin": Tissue(30.0, 0.05, 0.45, 0.40, 0.5),
    "brain": Tissue(35.0, 0.04, 0.56, 0.40, 0.1),
    "lens": Tissue(120.0, 0.0, 0.50, 0.15, 1.0),
    "vitreous": Tissue(8.0, 0.0, 0.12, 1.00, 0.1),
    "optic nerve": Tissue(35.0, 0.02, 0.60, 0.40, 0.3),
    "csf": Tissue(8.0, 0.0, 0.12, 1.00, 0.0),
    "dura": Tissue(60.0, 0.04, 0.45, 0.30, 1.0),
    "blood": Tissue(50.0, 1.0, 0.05, 0.05, 0.2),
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


_LABELLED = {
    "air": AIR_LABELS,
    "mucosa": (Label.MUCOSA,),
    "inferior turbinate": (Label.INFERIOR_TURBINATE,),
    "middle turbinate": (Label.MIDDLE_TURBINATE,),
    "superior turbinate": (Label.SUPERIOR_TURBINATE,),
    "cartilage": (Label.SEPTAL_CARTILAGE,),
    "polyp": (Label.POLYP,),
    "mucus": (Label.MUCUS,),
    "inspissated mucus": (Label.INSPISSATED_MUCUS,),
    "cancellous bone": (Label.THICK_BONE,),
    "bone": (Label.SEPTAL_BONE,),
    "thin bone": (Label.ETHMOID_SEPTUM, Label.BASAL_LAMELLA),
    "turbinate bone": (Label.TURBINATE_BONE,),
    "lamina papyracea": (Label.LAMINA_PAPYRACEA,),
    "uncinate": (Label.UNCINATE,),
    "skull base": (Label.CRIBRIFORM, Label.FOVEA),
    "sphenoid canal": (Label.SPHENOID_WALL,),
    "tooth": (Label.TEETH,),
    "fat": (Label.FAT, Label.PTERYGOPALATINE_FOSSA, Label.ORBITAL_FISSURE),
    "muscle": (Label.MUSCLE, Label.EXTRAOCULAR_MUSCLE),
    "skin": (Label.SKIN,),
    "vitreous": (Label.GLOBE,),
    "lens": (Label.LENS,),
    "optic nerve": (
        Label.OPTIC_NERVE,
        Label.VIDIAN_NERVE,
        Label.MAXILLARY_NERVE,
    ),
    "brain": (Label.BRAIN,),
    "dura": (Label.DURA,),
    "csf": (Label.CSF, Label.NASOLACRIMAL_DUCT),
    "blood": (
        Label.INTERNAL_CAROTID,
        Label.ETHMOIDAL_ARTERY,
        Label.SPHENOPALATINE_ARTERY,
    ),
}
TISSUE_OF: dict[Label, Tissue] = {
    label: TISSUES[name] for name, labels in _LABELLED.items() for label in labels
}
"""The tissue behind every label."""
