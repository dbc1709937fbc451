"""What the benchmarks look at: a phantom's head and a real one, from two places each.

The real scan is no part of the project. It is looked for in the folder named by
the environment variable PARAVOL_DATA, else in ``shared/data`` beside the repository.
"""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy import bone_transfer_function, classic_transfer_function, sinus_phantom
from anatomy.redistance import FARTHEST_MM, redistance
from benchmarks.machine import ROOT
from benchmarks.plan import UnavailableError
from benchmarks.references import References
from renderers.scene import AirSurface, Camera, PhongMaterial, Projection, Scene, Volume

DATA_VARIABLE = "PARAVOL_DATA"
HEAD_CT_FILE = "head_ct_headsq.npz"
HEAD_CT_MM = 1.5
"""Cubic voxels the scan is interpolated to: its own slice distance."""

AIR_THRESHOLD_HU = -480.0
RAW_OF_WATER = 1024.0
"""The scan's offset from HU, from its soft tissue; it is not documented."""

MUCOSA_BLOOD_CODE = 54
"""Blood volume 4.5 %, stored as ``255 * sqrt(.045)``; the scan tells no tissues."""

INSIDE_EXTENT = math.radians(44.0)
OUTSIDE_EXTENT = math.radians(20.0)


@dataclass(frozen=True, slots=True)
class ViewPoint:
    """Place an eye. extent: half field angle, radians."""

    name: str
    eye_mm: NDArray[np.float64]
    target_mm: NDArray[np.float64]
    extent: float

    def camera(self, size: int, projection: Projection) -> Camera:
        """Look from here with a square picture.

        A pinhole for comparisons with VTK, which has no other lens with an eye.
        """
        return Camera.looking_at(
            self.eye_mm,
            self.target_mm,
            extent=self.extent,
            size=(size, size),
            projection=projection,
        )


@dataclass(frozen=True, slots=True)
class Subject:
    """A head and where to look at it from."""

    scene: Scene
    views: dict[str, ViewPoint]

    def in_mode(self, quantity: str) -> Scene:
        """Return the scene as one of `CLASSIC_QUANTITIES` shows it."""
        if quantity == "shaded":
            return self.scene
        plain = PhongMaterial(ambient=1.0, diffuse=0.0, specular=0.0)
        transfer = {
            "wall": self.scene.transfer_function,
            "see-through": bone_transfer_function(),
        }[quantity]
        return replace(
            self.scene, lights=(), material=plain, transfer_function=transfer
        )


VIEWS = ("inside", "outside")

CLASSIC_QUANTITIES = ("wall", "see-through", "shaded")
"""Pictures of mode `classic`: opaque tissue without lights, bone through faint tissue
without lights, opaque tissue under four lights."""


class SubjectSource:
    """Know a subject by name; build it when it is first looked at.

    references: the pictures its own are compared with.
    """

    def __init__(self, name: str, build: Callable[[], Subject]) -> None:
        """Take a function that may raise `UnavailableError`."""
        self.name = name
        self.references = References()
        self._build = build

    @cached_property
    def subject(self) -> Subject:
        """Return the subject, built once."""
        return self._build()


@cache
def subjects(quick: bool) -> tuple[SubjectSource, ...]:
    """List the heads: the phantom at 1 mm (quick) or 0.5 mm, and the scan.

    All suites of a run share them, and the reference pictures made of them.
    """
    spacing_mm = 1.0 if quick else 0.5
    return (
        SubjectSource("phantom", lambda: phantom_subject(spacing_mm)),
        SubjectSource("head_ct", head_ct_subject),
    )


def phantom_subject(spacing_mm: float) -> Subject:
    """Return the default phantom: from the left nasal valve, and from the front.

    Also from its nasopharynx forwards, where the nearest wall is 6.8 mm away.
    """
    phantom = sinus_phantom(spacing_mm=spacing_mm)
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    place = {name: mark.position_mm for name, mark in phantom.landmarks.items()}
    inside = ViewPoint(
        "inside",
        place["nasal valve, left"],
        place["middle meatus, left"],
        INSIDE_EXTENT,
    )
    airy = ViewPoint(
        "nasopharynx", place["nasopharynx"], place["choana, left"], INSIDE_EXTENT
    )
    views = (inside, airy, _outside(scene.volume))
    return Subject(scene, {view.name: view for view in views})


def head_ct_subject() -> Subject:
    """Return the coarse real CT: from the nasopharynx forwards, and from the front.

    Raises UnavailableError where the file is absent.
    """
    path = data_folder() / HEAD_CT_FILE
    if not path.is_file():
        raise UnavailableError(
            f"there is no {HEAD_CT_FILE} in {path.parent}; name the folder that has "
            f"it in {DATA_VARIABLE}"
        )
    volume = head_ct_volume(path)
    distance = redistance(
        volume.values.astype(np.float32) - np.float32(AIR_THRESHOLD_HU), HEAD_CT_MM
    )
    surface = AirSurface(
        volume.with_values(distance, FARTHEST_MM),
        volume.with_values(np.full(volume.shape, MUCOSA_BLOOD_CODE, np.uint8), 0.0),
        volume.with_values(np.zeros(volume.shape, np.uint8), 0.0),
    )
    scene = Scene(volume, classic_transfer_function(), surface=surface)
    # Measured in the scan: the widest place behind the choanae, and the nasal cavity.
    inside = ViewPoint(
        "inside",
        volume.origin_mm + np.array([92.8, 92.8, 81.0]),
        volume.origin_mm + np.array([92.8, 50.0, 85.0]),
        INSIDE_EXTENT,
    )
    return Subject(scene, {"inside": inside, "outside": _outside(volume)})


def head_ct_volume(path: Path) -> Volume:
    """Read the scan as int16 HU on cubic voxels, slices from the feet upwards."""
    with np.load(path, allow_pickle=False) as archive:
        raw = archive["raw12"]
        spacing_mm = np.asarray(archive["spacing_zyx_mm"], dtype=np.float64)[::-1]
    # The file counts slices from the vertex down.
    scan = Volume(raw[::-1] - RAW_OF_WATER, spacing_mm, np.zeros(3))
    reach_mm = (np.array(scan.shape) - 1) * spacing_mm[::-1]
    # Never beyond the last centre, where there is only background.
    z, y, x = (HEAD_CT_MM * np.arange(int(mm / HEAD_CT_MM) + 1) for mm in reach_mm)
    values = np.empty((len(z), len(y), len(x)), np.int16)
    for k, height in enumerate(z):
        points = np.stack(np.broadcast_arrays(x, y[:, None], height), axis=-1)
        values[k] = np.rint(scan.sample(points))
    return Volume(values, np.full(3, HEAD_CT_MM), np.zeros(3))


def data_folder() -> Path:
    """Return the folder that real scans are looked for in; it need not exist."""
    named = os.environ.get(DATA_VARIABLE)
    return Path(named) if named else ROOT.parent / "shared" / "data"


def _outside(volume: Volume) -> ViewPoint:
    """Look at the whole volume from the front."""
    size_mm = float(np.linalg.norm(np.array(volume.shape[::-1]) * volume.spacing_mm))
    # Nearly straight, so that the grid's own sides, where it cuts through the head,
    # are hidden: they are no tissue boundaries.
    direction = np.array([0.06, -1.0, 0.04])
    direction /= np.linalg.norm(direction)
    distance = 0.52 * size_mm / math.tan(OUTSIDE_EXTENT)
    centre = volume.center_mm
    return ViewPoint("outside", centre + distance * direction, centre, OUTSIDE_EXTENT)
