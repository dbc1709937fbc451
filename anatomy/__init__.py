"""The patient: a synthetic sinus phantom, its tissues, landmarks and files."""

from anatomy.landmarks import Landmark
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom, distance_at
from anatomy.phantom import build_phantom as sinus_phantom

__all__ = ["Landmark", "Phantom", "PhantomParameters", "distance_at", "sinus_phantom"]
