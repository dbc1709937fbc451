"""The patient: a synthetic sinus phantom, its tissues, landmarks and files."""

from anatomy.cache import sinus_phantom
from anatomy.hazards import hazard_distances
from anatomy.landmarks import Landmark
from anatomy.opacity import Opacity
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom, build_phantom, distance_at
from anatomy.population import draw_parameters
from anatomy.presets import bone_transfer_function, classic_transfer_function
from anatomy.probing import PlateSample, TissueSample, plate_at, tissue_at
from anatomy.resonance import magnetic_resonance
from anatomy.scoring import lund_mackay
from anatomy.variants import with_variants

__all__ = [
    "Landmark",
    "Opacity",
    "Phantom",
    "PhantomParameters",
    "PlateSample",
    "TissueSample",
    "bone_transfer_function",
    "build_phantom",
    "classic_transfer_function",
    "distance_at",
    "draw_parameters",
    "hazard_distances",
    "lund_mackay",
    "magnetic_resonance",
    "plate_at",
    "sinus_phantom",
    "tissue_at",
    "with_variants",
]
