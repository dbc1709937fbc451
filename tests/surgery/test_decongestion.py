"""Laws of decongestion: turbinates shrink, nothing else; nothing breaks."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import pyvista
from scipy import ndimage

from anatomy import sinus_phantom
from anatomy.tissue import Label
from paravol.patient import decongested, load_patient, no_progress
from renderers.scene import AirSurface, Volume
from scenarios.scenario import Head, Scenario
from surgery.decongestion import BLOOD_BIAS, SHRINKS_MM, decongest
from surgery.patient import OperatedPatient
from system import UserError

TURBINATES = (Label.INFERIOR_TURBINATE, Label.MIDDLE_TURBINATE, Label.TURBINATE_BONE)


Shrunk = tuple[AirSurface, Volume, AirSurface]
"""A surface before, its labels, and the surface after."""


@pytest.fixture(scope="module")
def head() -> Shrunk:
    phantom = sinus_phantom()
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    return surface, phantom.labels, decongest(surface, phantom.labels)


def test_the_airway_only_widens_and_no_more_than_it_shrinks(head: Shrunk) -> None:
    before, _, after = head
    d, now = before.distance.values, after.distance.values
    assert np.all(now <= d)
    tissue = (d > 0) & (now <= 0)
    assert d[tissue].max() <= SHRINKS_MM + 0.1
    assert tissue.sum() * 0.125 > 500, "two turbinates a side lose half a mL and more"


def test_only_turbinates_shrink(head: Shrunk) -> None:
    before, labels, after = head
    gone = (before.distance.values > 0) & (after.distance.values <= 0)
    near = ndimage.binary_dilation(np.isin(labels.values, TURBINATES), iterations=2)
    assert not np.any(gone & ~near)
    assert not np.any(gone & (labels.values == Label.TURBINATE_BONE))
    others = ~near & (before.distance.values > 0)
    np.testing.assert_array_equal(
        before.distance.values[others] > 0, after.distance.values[others] > 0
    )


def test_nothing_comes_loose_and_no_plate_is_broken_through(head: Shrunk) -> None:
    """Of the surface as it is drawn: as many pieces, and as many holes, as before."""
    found = []
    for surface in (head[0], head[2]):
        field = surface.distance.values
        grid = pyvista.ImageData(dimensions=field.shape[::-1])
        grid["mm"] = field.ravel()
        mesh = grid.contour([0.0], scalars="mm", method="flying_edges")
        mesh = mesh.connectivity()
        edges = mesh.extract_all_edges().n_cells
        pieces = int(mesh["RegionId"].max()) + 1
        found.append((pieces, mesh.n_points - edges + mesh.n_cells))
    assert found[0] == found[1]


def test_bone_stays_covered(head: Shrunk) -> None:
    before, labels, after = head
    bone = labels.values == Label.TURBINATE_BONE
    bare = [
        ndimage.binary_dilation(s.distance.values <= 0) & bone for s in (before, after)
    ]
    assert bone.sum() > 1000
    np.testing.assert_array_equal(bare[0], bare[1])


def test_the_new_field_is_no_farther_than_the_surface(head: Shrunk) -> None:
    """Rays and tools may go as far as it says: nowhere does it grow faster than a
    distance, but for the little that a first-order distance is off."""
    d = head[2].distance.values
    h = 0.5
    for axis in range(3):
        assert np.abs(np.diff(d, axis=axis)).max() <= h * 1.1


def test_books_of_a_decongested_head_balance(head: Shrunk) -> None:
    patient = OperatedPatient(head[2], None, head[1])
    assert patient.books.counts == 0
    assert patient.pristine is head[2]


def test_all_blood_content_falls_to_the_same_share(head: Shrunk) -> None:
    """Fractions are ``(v / 255)^2``, rounded to a step of v."""
    before, after = (s.blood.values.astype(np.float64) for s in (head[0], head[2]))
    assert np.abs(after - before * np.sqrt(BLOOD_BIAS)).max() <= 0.5


def test_a_scenario_asks_for_a_decongested_head() -> None:
    """Contacts, hashes and bleeding follow; the CT is the one taken before."""
    asked = [Head(spacing_mm=1.0, decongested=d) for d in (False, True)]
    plain, pale = (
        load_patient(Scenario("short", "Short", head=head), no_progress)
        for head in asked
    )
    assert plain.surface_sha256 != pale.surface_sha256
    assert pale.structures is not None
    assert pale.structures.distance is pale.surface.distance
    assert (plain.blood_bias, pale.blood_bias) == (1.0, BLOOD_BIAS)
    np.testing.assert_array_equal(plain.scene.volume.values, pale.scene.volume.values)
    bare = dataclasses.replace(plain, structures=None)
    with pytest.raises(UserError, match="decongested"):
        decongested(bare)


def test_nothing_to_shrink_is_the_same_surface() -> None:
    phantom = sinus_phantom()
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    assert decongest(surface, phantom.labels, 0.0) is surface
    none = phantom.labels.with_values(np.zeros_like(phantom.labels.values), 0.0)
    assert decongest(surface, none) is surface
    with pytest.raises(UserError, match="0 to 3"):
        decongest(surface, phantom.labels, 5.0)
    operated = OperatedPatient(surface, None).surface
    with pytest.raises(UserError, match="before"):
        decongest(operated, phantom.labels)


def test_a_head_is_shrunk_once(head: Shrunk, tmp_path: Path) -> None:
    """What was kept is the same; what is broken is made again."""
    surface, labels, shrunk = head
    for _ in range(2):
        found = decongest(surface, labels, folder=tmp_path)
        assert np.array_equal(found.distance.values, shrunk.distance.values)
        (entry,) = tmp_path.glob("*.npz")
    entry.write_bytes(entry.read_bytes()[:-1000])
    again = decongest(surface, labels, folder=tmp_path)
    assert np.array_equal(again.distance.values, shrunk.distance.values)
    decongest(surface, labels, 0.5, folder=tmp_path)
    assert len(list(tmp_path.glob("*.npz"))) == 2
