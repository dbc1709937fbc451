"""The patient: a synthetic sinus phantom, its tissues, landmarks and files."""

from anatomy.cache import sinus_phantom
from anatomy.landmarks import Landmark
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom, build_phantom, distance_at
from anatomy.tissue import bone_transfer_function, classic_transfer_function

__all__ = [
    "Landmark",
    "Phantom",
    "PhantomParameters",
    "bone_transfer_function",
    "build_phantom",
    "classic_transfer_function",
    "distance_at",
    "sinus_phantom",
]
