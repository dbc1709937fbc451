"""Eight wounds in the default nose and where they are seen from."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from anatomy import Phantom, PhantomParameters, classic_transfer_function, sinus_phantom
from renderers.scene import AirSurface, Camera, Scene
from surgery.edit import CuttingLimits
from surgery.patient import OperatedPatient
from surgery.solids import Rows, capsule

Place = tuple[float, float, float]

SEED = 1
HALF_FIELD_DEG = 40.0
DRILL = CuttingLimits(1000.0, 50.0)
"""Takes whatever it meets: these are wounds to look at, not to judge."""


@dataclass(frozen=True, slots=True)
class WoundedView:
    """Name a wound, the cuts that make it, and a view: eye and target, LPS mm."""

    name: str
    cuts: tuple[tuple[Place, Place, float], ...]
    eye: Place
    target: Place

    def camera(self, size: int) -> Camera:
        """Return a fisheye scope's camera of so many pixels a side."""
        return Camera.looking_at(
            np.array(self.eye),
            np.array(self.target),
            extent=np.radians(HALF_FIELD_DEG),
            size=(size, size),
        )

    def solids(self) -> list[Rows]:
        """Return what the cuts take, one after the other."""
        return [
            capsule(a, b, radius, rough_mm=0.25, seed=n)
            for n, (a, b, radius) in enumerate(self.cuts)
        ]


_HEAD = (-5.9, 14.3, 24.0)
_BITE = ((-5.9, 14.3, 24.0), (-5.85, 13.88, 23.58), 1.5)
_BITES = (
    _BITE,
    ((-5.9, 14.9, 25.4), (-5.8, 15.3, 25.0), 1.5),
    ((-5.7, 15.7, 23.0), (-5.7, 15.9, 23.6), 1.4),
)
_UNCINATE = (
    ((-9.3, 18.6, 31.0), (-9.6, 19.6, 27.5), 1.6),
    ((-9.6, 19.6, 27.5), (-9.8, 22.0, 23.8), 1.6),
)

VIEWS = (
    WoundedView("bite", (_BITE,), (-5.235, 8.632, 19.059), _HEAD),
    WoundedView("three bites", _BITES, (-5.235, 8.632, 19.059), _HEAD),
    WoundedView("near", _BITES, (-5.3, 11.55, 22.38), _HEAD),
    WoundedView(
        "sphenoidotomy",
        (((-3.6, 52.0, 33.6), (-3.8, 57.5, 34.6), 2.4),),
        (-3.2, 44.0, 28.5),
        (-3.7, 54.0, 34.0),
    ),
    WoundedView("uncinectomy", _UNCINATE, (-8.3, 13.5, 22.5), (-9.7, 20.5, 25.5)),
    WoundedView(
        "maxillary ostium",
        (*_UNCINATE, ((-10.5, 26.6, 23.2), (-16.5, 27.6, 22.8), 2.4)),
        (-10.0, 19.0, 29.0),
        (-13.4, 27.4, 23.0),
    ),
    WoundedView(
        "furrow",
        (((-7.2, 9.0, 10.5), (-7.0, 20.0, 9.0), 1.7),),
        (-4.4, 1.0, 11.5),
        (-7.0, 12.0, 10.0),
    ),
    WoundedView(
        "septum",
        (((-1.6, 13.0, 20.0), (-0.9, 13.0, 20.0), 1.5),),
        (-4.2, 6.0, 19.0),
        (-1.4, 13.0, 20.0),
    ),
)


@cache
def wounded_phantom() -> Phantom:
    """Return the head that is cut."""
    return sinus_phantom(PhantomParameters(seed=SEED), spacing_mm=0.5)


def wounded(view: WoundedView) -> OperatedPatient:
    """Return the head with the cuts of a view."""
    phantom = wounded_phantom()
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    patient = OperatedPatient(surface, phantom.layers, phantom.labels)
    for solids in view.solids():
        patient.carve(solids, DRILL)
    return patient


def scene_of(patient: OperatedPatient) -> Scene:
    """Return what renderers draw of a patient."""
    volume = wounded_phantom().ct
    return Scene(volume, classic_transfer_function(), surface=patient.surface)
