"""A lopsided head whose face was scanned in a frame of its own."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from anatomy.files.surfaces import Surface
from app.vtk.case_surfaces import zero_set
from devices import RegistrationError
from paravol.registration.face_fit import register_face
from paravol.registration.skin import Skin
from renderers.scene import Volume

MARKS = {
    "face 1": np.array([0.0, -62.0, 30.0]),
    "face 2": np.array([-45.0, -30.0, 10.0]),
    "face 3": np.array([46.0, -34.0, 0.0]),
    "face 4": np.array([4.0, -58.0, -35.0]),
}


@pytest.fixture(scope="module")
def field() -> Volume:
    """An egg with a nose that is bent to its left; negative outside."""
    axis = np.arange(-90.0, 91.0, 2.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    egg = 70 - np.sqrt((x * 1.2) ** 2 + y**2 + (z * 0.9) ** 2)
    nose = 16 - np.sqrt((x - 5) ** 2 + ((y + 72) / 1.3) ** 2 + ((z + 5) / 1.6) ** 2)
    head = np.maximum(egg, nose)
    return Volume(
        np.clip(head, -12, 6).astype(np.float32),
        np.full(3, 2.0),
        np.full(3, -90.0),
        background=-12.0,
    )


@pytest.fixture(scope="module")
def face(field: Volume) -> Surface:
    whole = zero_set(field)
    assert whole is not None
    front = (whole.vertices[whole.faces][..., 1] < -10).all(axis=1)
    used, faces = np.unique(whole.faces[front], return_inverse=True)
    return Surface(whole.vertices[used], faces.reshape(-1, 3).astype(np.int32))


def scanner_from_patient() -> NDArray[np.float64]:
    matrix = np.eye(4)
    turn = Rotation.from_euler("xyz", [20, -35, 80], degrees=True)
    matrix[:3, :3] = turn.as_matrix()
    matrix[:3, 3] = (300.0, -40.0, 120.0)
    return matrix


def test_coarse_landmarks_and_a_surface_find_the_place(
    field: Volume, face: Surface
) -> None:
    there = scanner_from_patient()
    rng = np.random.default_rng(2)
    on_face = {
        name: there[:3, :3] @ (place + 1.5 * rng.normal(size=3)) + there[:3, 3]
        for name, place in MARKS.items()
    }
    fit = register_face(face.moved(there), on_face, MARKS, Skin(field))
    back = fit.patient_from_face @ there
    moved = face.vertices @ back[:3, :3].T + back[:3, 3]
    errors = np.linalg.norm(moved - face.vertices, axis=1)
    assert fit.landmark_rms_mm > 0.5
    assert errors.max() < 1.0
    assert fit.surface_rms_mm < 0.5
    assert fit.used > 0.8


def test_what_does_not_fit_is_refused(field: Volume, face: Surface) -> None:
    skin = Skin(field)
    mirrored = {name: place * (-1, 1, 1) for name, place in MARKS.items()}
    inches = Surface(face.vertices / 25.4, face.faces)
    small = {name: place / 25.4 for name, place in MARKS.items()}
    with pytest.raises(ValueError, match="share 1 landmarks"):
        register_face(face, {"face 1": MARKS["face 1"]}, MARKS, skin)
    with pytest.raises((ValueError, RegistrationError)):
        register_face(inches, small, MARKS, skin)
    swapped = dict(zip(MARKS, reversed(list(mirrored.values())), strict=True))
    with pytest.raises((ValueError, RegistrationError)):
        register_face(face, swapped, MARKS, skin)


@pytest.mark.parametrize(
    ("places", "reason"),
    [
        ({n: np.array([0.0, -60.0, 10.0 * i]) for i, n in enumerate(MARKS)}, "line"),
        ({n: np.array([3.0, -60.0, 10.0]) for n in MARKS}, "."),
        ({n: np.array([np.nan, -60.0, 10.0]) for n in MARKS}, "finite"),
    ],
)
def test_landmarks_that_place_nothing_are_refused(
    field: Volume, face: Surface, places: dict[str, NDArray[np.float64]], reason: str
) -> None:
    with pytest.raises((ValueError, RegistrationError), match=reason):
        register_face(face, places, places, Skin(field))
