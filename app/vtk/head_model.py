"""The head of the overview as triangles: airway and skin, each with its tint."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from paravol.patient import PatientScene
from paravol.slices.cutaway import Cutaway
from renderers.scene import AirSurface, Volume
from scenarios import Scenario

COARSENESS = 3
"""Every third voxel: 1.5 mm is a few pixels here, and a ninth of the triangles."""

FINE = 1
"""In an abstract scene, whose walls are flat and whose hoops would fall apart."""

MUCOSA = (232, 118, 106, 0.34)
FACE = (226, 206, 190, 0.22)
"""Red, green, blue, opacity. The face is only a hint of where one is."""

SKIN_SHARE = 0.5
"""Triangles with more of the face than this give way to those of the whole head."""

AROUND_MM = 45.0
"""Of the head beside the airway in the first view."""


@dataclass(frozen=True, slots=True)
class HeadModel:
    """The head as triangles; may be built in any thread.

    mesh: point array ``rgba`` is the tint of mucosa or face.
    targets: positions ``(3,)`` by name.
    cut_open: makes the head's cutaway, in seconds; None where there is none.
    focus_mm: corners ``(2, 3)`` of what the first view shows; None for all.
    renew: makes the mesh again, from the surface as it is then.
    """

    mesh: pv.PolyData
    targets: dict[str, NDArray[np.float64]]
    cut_open: Callable[[], Cutaway] | None = None
    focus_mm: NDArray[np.float64] | None = None
    renew: Callable[[], pv.PolyData] | None = None


def session_head(
    patient: PatientScene, scenario: Scenario, cut_open: Callable[[], Cutaway] | None
) -> HeadModel:
    """Build what is shown of the head that a session goes through; see `head_model`."""
    return head_model(
        patient.surface,
        patient.positions(scenario.targets),
        cut_open,
        None if patient.face is None else patient.face(),
        FINE if scenario.head.scene else COARSENESS,
    )


def head_model(
    surface: AirSurface,
    targets: Mapping[str, NDArray[np.float64]],
    cut_open: Callable[[], Cutaway] | None = None,
    face: Volume | None = None,
    coarseness: int = COARSENESS,
) -> HeadModel:
    """Contour the air surface coarsely; tint the cavity's wall and the face.

    The face is what borders on air that lies open to the front. The phantom carries
    dry skin as well, but only round the nostrils. face: the distance to the skin of
    the whole head, mm, negative in the room, on a coarse grid of its own; with it, the
    whole head is shown in place of what the air surface has of the face. coarseness:
    each so many-th voxel is looked at.
    """
    skin = None if face is None else _skin(face)
    cavity = _cavity(surface, coarseness, whole=face is None)
    focus = np.array(cavity.bounds).reshape(3, 2).T
    if face is not None:
        focus = focus + np.array([[-AROUND_MM], [AROUND_MM]])

    def renew() -> pv.PolyData:
        return _joined(_cavity(surface, coarseness, whole=face is None), skin)

    mesh = _joined(cavity, skin)
    return HeadModel(mesh, dict(targets), cut_open, focus, renew)


def _joined(cavity: pv.PolyData, skin: pv.PolyData | None) -> pv.PolyData:
    return cavity if skin is None else cavity.append_polydata(skin)


def _cavity(surface: AirSurface, coarseness: int, *, whole: bool) -> pv.PolyData:
    """Contour the air surface; point array ``rgba`` as of `HeadModel`.

    whole: with what it has of the face.
    """
    volume = surface.distance
    values = volume.values[::coarseness, ::coarseness, ::coarseness]
    grid = pv.ImageData(
        dimensions=values.shape[::-1],
        spacing=volume.spacing_mm * coarseness,
        origin=volume.origin_mm,
    )
    grid.point_data["distance"] = values.ravel()
    mesh: pv.PolyData = grid.contour([0.0], scalars="distance").smooth_taubin(
        n_iter=10, pass_band=0.1
    )
    # y runs to the back: open air is air with nothing but air before it.
    open_air = np.logical_and.accumulate(values < 0.0, axis=1)
    outside = gaussian_filter(open_air.astype(np.float32), 1.2)
    at = (mesh.points - volume.origin_mm) / (volume.spacing_mm * coarseness)
    share = np.clip(4.0 * map_coordinates(outside, at.T[::-1], order=1), 0.0, 1.0)
    tint = np.array(MUCOSA) + share[:, None] * (np.array(FACE) - np.array(MUCOSA))
    tint[:, 3] *= 255.0
    mesh.point_data["rgba"] = tint.astype(np.uint8)
    if whole:
        return mesh
    cells = mesh.regular_faces
    inner = cells[(share[cells] < SKIN_SHARE).any(axis=1)]
    cavity = pv.PolyData.from_regular_faces(mesh.points, inner)
    cavity.point_data["rgba"] = mesh.point_data["rgba"]
    cleaned: pv.PolyData = cavity.clean()
    return cleaned


def _skin(face: Volume) -> pv.PolyData:
    """Contour the skin of the whole head; point array ``rgba`` as of `HeadModel`."""
    values = np.asarray(face.values, np.float32)
    grid = pv.ImageData(
        dimensions=values.shape[::-1],
        spacing=face.spacing_mm,
        origin=face.origin_mm,
    )
    grid.point_data["distance"] = values.ravel()
    mesh: pv.PolyData = grid.contour([0.0], scalars="distance").smooth_taubin(
        n_iter=10, pass_band=0.1
    )
    tint = np.array([*FACE[:3], 255.0 * FACE[3]])
    mesh.point_data.clear()
    mesh.point_data["rgba"] = np.tile(tint.astype(np.uint8), (mesh.n_points, 1))
    return mesh
