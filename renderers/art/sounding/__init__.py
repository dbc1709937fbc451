"""Lines cast through a scene to learn what steps of a length leave out of a picture."""

from renderers.art.sounding.soundings import Soundings, settled

__all__ = ["Soundings", "settled"]
