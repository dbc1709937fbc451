"""A scan shown whole, from outside or inside, as a volume or as a surface."""

from paravol.volume.look import LookPoint, VolumeLook, load_look, save_look
from paravol.volume.orbit import Orbit
from paravol.volume.presets import presets
from paravol.volume.scan import Scan, scans_of
from paravol.volume.volume_view import Drawn, Method, VolumeView, Wish

__all__ = [
    "Drawn",
    "LookPoint",
    "Method",
    "Orbit",
    "Scan",
    "VolumeLook",
    "VolumeView",
    "Wish",
    "load_look",
    "presets",
    "save_look",
    "scans_of",
]
