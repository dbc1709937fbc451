"""The patient: a synthetic sinus phantom, its tissues, landmarks and files."""

from anatomy.files.cache import sinus_phantom
from anatomy.hazard_volumes import HazardVolumes
from anatomy.phantom.parameters import Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom, distance_at
from anatomy.phantom.population import draw_parameters
from anatomy.phantom.synthetic_mr import magnetic_resonance
from anatomy.phantom.variants import with_variants
from anatomy.queries.hazards import hazard_distances
from anatomy.queries.landmarks import Landmark
from anatomy.queries.lund_mackay import lund_mackay
from anatomy.queries.probing import PlateSample, plate_at
from anatomy.scan.histogram import bone_transfer_function, classic_transfer_function
from anatomy.wall_layers import Layer, LayerSample, WallKind, WallLayers, layer_at

__all__ = [
    "HazardVolumes",
    "Landmark",
    "Layer",
    "LayerSample",
    "Opacity",
    "Phantom",
    "PhantomParameters",
    "PlateSample",
    "WallKind",
    "WallLayers",
    "bone_transfer_function",
    "build_phantom",
    "classic_transfer_function",
    "distance_at",
    "draw_parameters",
    "hazard_distances",
    "layer_at",
    "lund_mackay",
    "magnetic_resonance",
    "plate_at",
    "sinus_phantom",
    "with_variants",
]
