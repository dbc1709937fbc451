"""What a frame showed of an operated head stays what it was."""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from paravol.looks import Patient
from paravol.patient import PatientScene
from paravol.sessions.session_setup import operate_on
from paravol.snapshots import view_sources
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
from paravol.snapshots.view_sources import mark_of, session_views
from paravol.view import Frame
from renderers.scene import Camera, Change, ChangeKind, GBuffer, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.scene_loader import load_scene
from scenarios import FrameState, Moment, Sample, load_scenario, tip_frame
from scenarios.instrument_state import InstrumentState
from surgery import solids
from surgery.edit import CuttingLimits
from surgery.patient import OperatedPatient
from surgery.pushing import ToolCapsule
from tests.recorded_flight import WAY, Flight
from tests.scenes import make_scene

ANY = CuttingLimits(force_n=1e3, bone_mm=50.0)

RENDERERS: tuple[Literal["fsr", "art"], ...] = ("fsr", "art")


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
    assert first is not None
    assert second is not None
    assert first.distance.values.tobytes() == second.distance.values.tobytes()
    assert first.wounds is not None
    assert second.wounds is not None
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
    patient: OperatedPatient, scene: Scene, tmp_path: Path, look: ClassicLook | None
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
    view = FrameState(picture_of(scene).to_camera(), np.eye(4), np.eye(4), 5.0)
    cut(patient, (20, 13, 17))
    tissue, then = OperatedHead.of(patient), living(patient, scene)
    cut(patient, (12, 20, 9))
    for wanted, expected in ((tissue, then), (None, living(patient, scene))):
        request = requests.request(client, view, gain=1.0, number=0, tissue=wanted)
        found = load_scene(client.data, request).surface
        assert found is not None
        assert expected.surface is not None
        assert_array_equal(found.distance.values, expected.surface.distance.values)


def test_the_first_frame_of_a_moment_keeps_its_tissue(
    patient: OperatedPatient, scene: Scene
) -> None:
    selected = SelectedFrame(Moment("a", 2.0))
    view = FrameState(picture_of(scene).to_camera(), np.eye(4), np.eye(4), 5.0)
    frame = Frame(np.zeros((2, 2, 3), np.uint8), GBuffer.empty(2, 2), 1.0)
    heads: dict[float, OperatedHead | None] = {}
    for number, time_s in enumerate((0.5, 1.9, 1.97, 2.2)):
        cut(patient, (20, 13 + number, 17))
        # copying costs time in flight: no other frame's tissue is asked for
        wanted = selected.wants(time_s)
        assert wanted == (time_s == 1.97)
        heads[time_s] = OperatedHead.of(patient) if wanted else None
        selected.offer(number, view, frame, time_s, heads[time_s])
    assert (selected.number, selected.tissue) == (2, heads[1.97])


def test_a_look_follows_what_is_cut(scene: Scene) -> None:
    """With either renderer; as a patient that was never looked at before."""
    whole = Patient(scene, {}, "")
    operated, operation = operate_on(whole)
    camera = picture_of(scene).to_camera()

    def looks(patient: Patient) -> list[str]:
        both = [patient.look(camera, renderer=name, gain=1.0) for name in RENDERERS]
        arrays = (array for look in both for array in (look.rgb, look.depth_mm))
        return [digest_of(array) for array in arrays]

    before = looks(operated)
    surface = operated.surface
    middle = np.array(surface.distance.shape[::-1]) // 2
    for place in (middle, middle + 5):
        change = cut(operation.patient, tuple(place.tolist()))
        change = operation.pushing.follow(change)
        operated.update(change)
        wet = Change(change.generation, place, place, ChangeKind.FILM)
        operated.update(wet)
        after = looks(operated)
        assert after != before
        assert after == looks(Patient(operated.scene, {}, ""))


def test_a_dent_is_pictured_as_it_was_and_is_no_wound(
    scene: Scene, tmp_path: Path
) -> None:
    """Also when the tissue has sprung back since."""
    whole = PatientScene(scene, {}, "a" * 64)
    _, operation = operate_on(whole)
    patient, pushing = operation.patient, operation.pushing
    pushing.follow(cut(patient, (20, 13, 17)))
    rest = OperatedHead.of(patient, pushing)
    distance = patient.surface.distance
    inside = np.argwhere(np.abs(distance.values) < 0.3)
    matrix = distance.world_from_voxel
    for place in inside[:: len(inside) // 10, ::-1]:
        at = matrix[:3, :3] @ place + matrix[:3, 3]
        pushing.push(0.0, 2, ToolCapsule.of(at, (0.0, 0.0, 1.0), 1.0))
        if (pushing.surface.distance.values != distance.values).any():
            break
    shown = pushing.surface
    assert shown.wounds is not None
    then = shown.distance.values.copy(), shown.wounds.pristine.values.copy()
    assert (then[0] != distance.values).any()
    assert shown.rest is not None
    offsets = [shown.rest.x, shown.rest.y, shown.rest.z]
    lying = [axis.values.copy() for axis in offsets]
    tissue = OperatedHead.of(patient, pushing)
    assert tissue.digest not in (rest.digest, "")
    pushing.push(0.1, 3, None)
    pushing.push(9.0, 4, None)
    assert OperatedHead.of(patient, pushing).digest == rest.digest
    client = SnapshotClient(tmp_path / "spool")
    request = client.request_scope(tissue.surface, picture_of(scene).to_camera())
    loaded = load_scene(client.data, request).surface
    for surface in (tissue.surface.thawed(), tissue.scene(scene).surface, loaded):
        assert surface is not None
        assert surface.wounds is not None
        assert surface.distance.values.tobytes() == then[0].tobytes()
        assert surface.wounds.pristine.values.tobytes() == then[1].tobytes()
        assert surface.rest is not None
        found = surface.rest.x, surface.rest.y, surface.rest.z
        for axis, values in zip(found, lying, strict=True):
            assert axis.values.tobytes() == values.tobytes()
        moved = np.argwhere(np.any(lying, axis=0))[:, ::-1]
        assert np.all((moved > surface.rest.box[:3]) & (moved < surface.rest.box[3:]))
        pristine = patient.surface.wounds
        assert pristine is not None
        assert (
            surface.rest.pristine.values.tobytes() == pristine.pristine.values.tobytes()
        )


def digest_of(values: NDArray[Any]) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()


def recorded(folder: Path, patient: PatientScene) -> tuple[list[Sample], list[str]]:
    """Record a debrider's way through the middle; give distances as it left them."""
    scenario, _ = load_scenario("first_flight")
    flight = Flight(scenario, patient, size=16)
    assert flight.operation is not None
    distance = flight.operation.patient.surface.distance
    samples, states = [], []
    with flight.recorded(folder):
        for n in range(30):
            at = distance.center_mm + WAY * (0.15 * n - 2)
            state = InstrumentState(
                "microdebrider", is_working=True, is_sucking=True, undone=n // 20
            )
            frame = tip_frame(at - 3 * WAY, WAY)
            samples.append(Sample(0.02 * n, frame, 0.0, at, WAY, 0, state))
            flight.step(samples[-1])
            states.append(digest_of(distance.values))
    assert len(set(states)) > 3
    return samples, states


def test_a_recording_is_pictured_as_it_was_at_each_time(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In whatever order times are asked for, undoing included."""
    scenario, _ = load_scenario("first_flight")
    landmarks = dict.fromkeys(scenario.targets, scene.volume.center_mm)
    patient = PatientScene(scene, landmarks, "a" * 64)
    monkeypatch.setattr(view_sources, "load_patient", lambda *_: patient)
    samples, states = recorded(tmp_path / "flight.paravol", patient)
    chosen = [12, 0, 29, 19, 12]
    times = np.array([samples[n].time_s for n in chosen])
    head, views = session_views(
        tmp_path / "flight.paravol", times, 16, None, lambda *_: None
    )
    client = SnapshotClient(tmp_path / "spool")
    for view, number in zip(views, chosen, strict=True):
        request = head.request(client, view, RenderSettings())
        surface = load_scene(client.data, request).surface
        assert surface is not None
        assert digest_of(surface.distance.values) == states[number]
        if view.operated is None:
            assert scene.surface is not None
            assert states[number] == digest_of(scene.surface.distance.values)
        else:
            assert view.operated.time_s == samples[number].time_s
    assert views[0] == views[4]
    assert views[0].operated is not None
