"""The tissues of the head: their numbers, labels and looks.

HU are means of published ranges; blood volume fractions give, through haemoglobin
absorption, the chromaticity measured on healthy inferior turbinates.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from renderers.scene.transfer import TransferFunction


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


class Side(IntEnum):
    """Name the values of the side volume."""

    MIDLINE = 0
    RIGHT = 1
    LEFT = 2


AIR_LABELS = frozenset(label for label in Label if label < Label.MUCOSA)


@dataclass(frozen=True, slots=True)
class Tissue:
    """Describe one tissue: CT number and healthy blood volume fraction."""

    hu: float
    blood_fraction: float


TISSUES: dict[str, Tissue] = {
    "air": Tissue(-1000.0, 0.0),
    "mucosa": Tissue(40.0, 0.11),
    "septum": Tissue(40.0, 0.085),
    "inferior turbinate": Tissue(45.0, 0.15),
    "middle turbinate": Tissue(45.0, 0.12),
    "superior turbinate": Tissue(45.0, 0.10),
    "uncinate": Tissue(40.0, 0.10),
    "torus": Tissue(60.0, 0.075),
    "nasopharynx": Tissue(40.0, 0.08),
    "sinus lining": Tissue(40.0, 0.045),
    "polyp": Tissue(25.0, 0.006),
    "cartilage": Tissue(100.0, 0.05),
    "thin bone": Tissue(1500.0, 0.003),
    "bone": Tissue(1100.0, 0.003),
    "cancellous bone": Tissue(500.0, 0.003),
    "tooth": Tissue(2200.0, 0.0),
    "fat": Tissue(-90.0, 0.02),
    "muscle": Tissue(50.0, 0.05),
    "skin": Tissue(30.0, 0.05),
    "brain": Tissue(35.0, 0.04),
    "lens": Tissue(120.0, 0.0),
    "vitreous": Tissue(8.0, 0.0),
    "optic nerve": Tissue(35.0, 0.02),
    "blood": Tissue(50.0, 1.0),
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


def decode_blood(stored: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Give the blood fractions that `encode_blood` stored."""
    return (stored.astype(np.float64) / 255) ** 2


def classic_transfer_function() -> TransferFunction:
    """Give the preset for mode `classic`: red mucosa, ivory bone, clear air.

    The ramp into mucosa is centred on -480 HU, half way from air: there alone its
    place does not depend on the scanner's blur.
    """
    nodes = [-1000.0, -600.0, -300.0, 100.0, 250.0, 700.0, 1500.0]
    color = [
        (0.55, 0.20, 0.18),
        (0.55, 0.20, 0.18),
        (0.55, 0.20, 0.18),
        (0.50, 0.16, 0.14),
        (0.75, 0.55, 0.42),
        (0.85, 0.78, 0.62),
        (0.90, 0.87, 0.80),
    ]
    kappa = [0.0, 0.0, 4.0, 4.0, 6.0, 20.0, 40.0]
    return TransferFunction(np.array(nodes), np.array(color), np.array(kappa))


def bone_transfer_function() -> TransferFunction:
    """Give the preset that shows bone through faint soft tissue.

    Thin walls reach 100-400 HU at clinical resolution, so its ramp starts there.
    """
    nodes = np.array([-1000.0, 60.0, 140.0, 500.0, 1500.0])
    color = np.array(
        [(0.6, 0.3, 0.25), (0.6, 0.3, 0.25), (0.8, 0.65, 0.5)] + [(0.9, 0.86, 0.78)] * 2
    )
    return TransferFunction(nodes, color, np.array([0.0, 0.0, 1.0, 8.0, 30.0]))
