"""Simple spaces in which a scope is practised before it enters a nose."""

from anatomy.abstract.scenes import SCENES, build_scene
from anatomy.abstract.space import LABELS, AbstractSpace

__all__ = ["LABELS", "SCENES", "AbstractSpace", "build_scene"]
