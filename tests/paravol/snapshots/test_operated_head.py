"""What a frame showed of an operated head stays what it was."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from paravol.snapshots.head_scene import HeadScene, RenderSettings
from paravol.snapshots.moments import SelectedFrame, SnapshotRequestFactory
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.view_file import (
    ClassicLook,
    OperatedMark,
    ScanHead,
    ViewCamera,
    ViewFile,
    load_view,
    save_view,
)
from paravol.snapshots.view_sources import mark_of
from renderers.scene import Camera, Change, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.scene_loader import load_scene
from scenarios import Moment, View
from surgery import solids
from surgery.edit import Taker
from surgery.patient import OperatedPatient
from tests.scenes import make_scene

ANY = Taker(force_n=1e3, bone_mm=50.0)


@pytest.fixture
def scene() -> Scene:
    return make_scene()


@pytest.fixture
def patient(scene: Scene) -> OperatedPatient:
    assert scene.surface is not None
    return OperatedPatient(scene.surface, None, None, scene.volume)


def cut(patient: OperatedPatient, place: tuple[int, int, int]) -> Change:
    """Cut a ball out around a voxel (i, j, k); leave it wet."""
    matrix = patient.surface.distance.world_from_voxel
    at = matrix[:3, :3] @ np.array(place) + matrix[:3, 3]
    edit = patient.carve(solids.capsule(at, at + 0.1, 2.5), ANY)
    assert edit is not None
    patient.wounds_film[place[2], place[1], place[0]] = 30
    return edit.change


def living(patient: OperatedPatient, before: Scene) -> Scene:
    """Return the scene as it is now, which no later cut touches."""
    assert patient.ct is not None
    ct = patient.ct.with_values(patient.ct.values.copy(), patient.ct.background)
    surface = OperatedHead.of(patient).surface.thawed()
    assert_array_equal(surface.distance.values, patient.surface.distance.values)
    return replace(before, volume=ct, surface=surface)


def equal(one: Scene, other: Scene) -> None:
    assert one.volume.values.tobytes() == other.volume.values.tobytes()
    for scene in one, other:
        assert scene.surface is not None
        assert scene.surface.wounds is not None
    first, second = one.surface, other.surface
    assert first is not None and second is not None  # noqa: PT018
    assert first.distance.values.tobytes() == second.distance.values.tobytes()
    assert first.wounds is not None and second.wounds is not None  # noqa: PT018
    assert first.wounds.film.values.tobytes() == second.wounds.film.values.tobytes()


def test_each_moment_is_found_again_whatever_is_cut_later(
    patient: OperatedPatient, scene: Scene
) -> None:
    kept = [(OperatedHead.of(patient), living(patient, scene))]
    for place in ((20, 13, 17), (12, 20, 9), (30, 8, 25)):
        cut(patient, place)
        kept.append((OperatedHead.of(patient), living(patient, scene)))
    assert len({head.digest for head, _ in kept}) == len(kept)
    for head, then in kept:
        equal(head.scene(scene), then)
    while patient.undo() is not None:
        pass
    patient.wounds_film[...] = 0
    first = OperatedHead.of(patient)
    assert first.digest == kept[0][0].digest == ""
    assert mark_of(first, None, 1.0) is None
    assert mark_of(None, None, 1.0) is None


def picture_of(scene: Scene, look: ClassicLook | None = None) -> ViewFile:
    centre = scene.volume.center_mm
    camera = Camera.looking_at(
        centre + np.array([0.5, -3.0, 1.0]), centre, size=(16, 16)
    )
    view = ViewFile(
        "paravol.view/1", ScanHead("none.nii"), ViewCamera.of(camera), (16, 16)
    )
    return view if look is None else msgspec.structs.replace(view, look=look)


@pytest.mark.parametrize("look", [None, ClassicLook()])
def test_a_view_of_an_operated_head_is_of_its_own_moment(
    patient: OperatedPatient,
    scene: Scene,
    tmp_path: Path,
    look: ClassicLook | None,
) -> None:
    states, views, then = {}, [picture_of(scene, look)], [scene]
    for number, place in enumerate([(20, 13, 17), (12, 20, 9)]):
        cut(patient, place)
        tissue = OperatedHead.of(patient)
        states[tissue.digest] = tissue
        mark = mark_of(tissue, tmp_path / "a.paravol", float(number))
        views.append(msgspec.structs.replace(views[0], operated=mark))
        then.append(living(patient, scene))
    cut(patient, (30, 8, 25))
    head, client = HeadScene(scene, "", states), SnapshotClient(tmp_path / "spool")
    for view, expected in zip(views, then, strict=True):
        save_view(tmp_path / "a.view.json", view)
        read = load_view(tmp_path / "a.view.json")
        assert read.operated == view.operated
        loaded = load_scene(client.data, head.request(client, view, RenderSettings()))
        if look is not None:
            assert_array_equal(loaded.volume.values, expected.volume.values)
            continue
        assert loaded.surface is not None
        assert expected.surface is not None
        assert_array_equal(
            loaded.surface.distance.values, expected.surface.distance.values
        )
        if view.operated is not None:
            equal(head.seen(view), expected)


def test_without_its_cuts_a_view_is_refused_with_what_to_do(scene: Scene) -> None:
    mark = OperatedMark("0" * 32, "/a/b.paravol", 12.25)
    view = msgspec.structs.replace(picture_of(scene), operated=mark)
    command = r"paravol snapshot /a/b\.paravol --time 12\.25"
    with pytest.raises(ValueError, match=command):
        HeadScene(scene, "").demand(view)
    unknown = msgspec.structs.replace(view, operated=OperatedMark("0" * 32))
    with pytest.raises(ValueError, match="paravol snapshot RECORDING --time 0"):
        HeadScene(scene, "").seen(unknown)


def test_a_kept_moment_is_of_its_frame(
    patient: OperatedPatient, scene: Scene, tmp_path: Path
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    requests = SnapshotRequestFactory(patient.surface, 1.45, 7, has_instrument=False)
    view = View(picture_of(scene).to_camera(), np.eye(4), np.eye(4), 5.0)
    cut(patient, (20, 13, 17))
    tissue, then = OperatedHead.of(patient), living(patient, scene)
    cut(patient, (12, 20, 9))
    for wanted, expected in ((tissue, then), (None, living(patient, scene))):
        request = requests.request(client, view, gain=1.0, number=0, tissue=wanted)
        found = load_scene(client.data, request).surface
        assert found is not None
        assert expected.surface is not None
        assert_array_equal(found.distance.values, expected.surface.distance.values)


def test_the_nearest_frame_keeps_its_tissue(patient: OperatedPatient) -> None:
    selected = SelectedFrame(Moment("a", 2.0))
    heads: dict[float, OperatedHead | None] = {}
    for number, time_s in enumerate((0.5, 1.5, 2.2, 3.0)):
        cut(patient, (20, 13 + number, 17))
        wanted = selected.wants(time_s)
        assert wanted == (time_s < 3)
        heads[time_s] = OperatedHead.of(patient) if wanted else None
        selected.offer(number, None, None, time_s, heads[time_s])  # type: ignore[arg-type]
    assert selected.tissue is heads[2.2]
