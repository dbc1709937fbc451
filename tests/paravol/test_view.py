"""What rests costs no new view, what moves is never shown where it was."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices import load_probe_path
from paravol.patient import load_patient
from paravol.sessions.session_setup import build_view, path_view
from paravol.view import EndoscopeView, Frame
from renderers.scene import Distortion, Material
from renderers.scene.facets import Facets
from renderers.scene.mesh import Mesh
from renderers.scene.spine import Spine
from scenarios import FrameState, load_scenario, tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, placed_tool

SIZE = (40, 40)
PLACES_S = (1.0, 2.0, 2.001)


Drawn = tuple[list[EndoscopeView], list[FrameState]]


@pytest.fixture(scope="module")
def patient(coarse_scenario: Path) -> Drawn:
    """Two renderers of one head, and a few views; some differ by the tool alone.

    By its place, its name and its jaws.
    """
    scenario, folder = load_scenario(str(coarse_scenario))
    path = load_probe_path(folder / scenario.path)
    patient = load_patient(scenario, lambda stage, share: None)
    views = [path_view(scenario, patient, path, t, SIZE) for t in PLACES_S]
    moved = views[0].world_from_instrument.copy()
    moved[:3, 3] += 0.5 * views[0].camera.frame[1]
    views.append(dataclasses.replace(views[0], world_from_instrument=moved))
    ahead = views[0].camera.eye_mm + 14 * views[0].camera.frame[3]
    before = tip_frame(ahead, views[0].camera.frame[3])
    for jaw in (1.0, 0.25):
        views.append(
            dataclasses.replace(
                views[0],
                world_from_instrument=before,
                instrument="upturned forceps",
                jaw=jaw,
            )
        )
    renderers = [build_view(scenario, patient, threads=1) for _ in range(2)]
    return renderers, views


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=2, max_size=10))
def test_frames_are_those_of_a_renderer_that_skips_nothing(
    patient: Drawn, order: list[int]
) -> None:
    (view, fresh), seen = patient
    before = view.views_skipped
    rests = 0
    last = None
    for number, place in enumerate(order):
        here = seen[place]
        frame = view.draw(here, number=number, elapsed_s=0.02, gain=0.7)
        buffer = fresh.gbuffer(here)
        lit = fresh.light(here, buffer)
        pixels = fresh.expose(here, buffer, lit, gain=0.7, number=number)
        np.testing.assert_array_equal(frame.pixels, pixels)
        np.testing.assert_array_equal(frame.gbuffer.depth_mm, buffer.depth_mm)
        rests += place == last
        last = place
    # the first may rest where the sequence before it ended
    assert view.views_skipped - before in (rests, rests + 1)


def test_a_jaw_that_moves_is_seen_to_move(patient: Drawn) -> None:
    (view, _), seen = patient
    closed, half, none = (
        view.draw(here, number=0, elapsed_s=0.0, gain=0.7).gbuffer
        for here in (seen[4], seen[5], dataclasses.replace(seen[4], instrument=NO_TOOL))
    )
    metal = [(each.material == Material.METAL).sum() for each in (closed, half, none)]
    assert metal[0] > 20
    assert metal[1] > 20
    assert metal[2] == 0
    assert (closed.depth_mm != half.depth_mm).any()
    # the tool hides tissue and never uncovers any
    assert (closed.depth_mm <= none.depth_mm).all()


def tool_at(
    view: FrameState, name: str, ahead_mm: float, below_mm: float
) -> FrameState:
    """The tip on the axis of the picture, the shaft so far below the lens."""
    eye, _, up, forward = view.camera.frame
    tip = eye + ahead_mm * forward
    pose = tip_frame(tip, tip - eye + below_mm * up)
    return dataclasses.replace(
        view, instrument=name, world_from_instrument=pose, jaw=0.0
    )


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_no_tool_is_seen_from_within_nor_darkens_what_is_behind_it(
    patient: Drawn, name: str
) -> None:
    """Wherever its shaft passes, through the lens included; tissue keeps its light."""
    (view, _), seen = patient
    bare = dataclasses.replace(seen[0], instrument=NO_TOOL)
    view._auto_gain.gain = None
    alone = view.draw(bare, number=0, elapsed_s=0.0)
    gain, bright = alone.gain, alone.pixels.mean()
    for ahead_mm, below_mm in ((1.0, 0.0), (6.0, 0.3), (9.0, 2.6), (14.0, 5.0)):
        view._auto_gain.gain = None
        here = tool_at(bare, name, ahead_mm, below_mm)
        frame = view.draw(here, number=0, elapsed_s=0.0)
        is_tool = frame.gbuffer.material == Material.METAL
        assert is_tool.mean() < 0.5
        # it may rise, where the tool's shadow lies on what is left to be seen
        assert frame.gain > 0.8 * gain
        beside = frame.pixels[~is_tool].mean()
        assert 0.8 < beside / bright < 2.0


def test_a_resting_scope_is_exposed_anew_each_time(patient: Drawn) -> None:
    """Grain and gain go on; the view is found once."""
    (view, _), seen = patient
    before = view.views_skipped
    frames = [view.draw(seen[1], number=n, elapsed_s=0.0, gain=0.7) for n in (7, 8, 7)]
    assert view.views_skipped - before >= 2
    first, other, again = (frame.fingerprint() for frame in frames)
    assert first == again != other
    assert np.array_equal(frames[0].pixels, frames[2].pixels)


@pytest.fixture(scope="module")
def shared(coarse_scenario: Path) -> EndoscopeView:
    """One renderer with two threads."""
    scenario, _ = load_scenario(str(coarse_scenario))
    patient = load_patient(scenario, lambda stage, share: None)
    return build_view(scenario, patient, threads=2)


def test_frames_begun_one_upon_another_are_those_drawn_one_by_one(
    patient: Drawn, shared: EndoscopeView
) -> None:
    """With the automatic gain, which each frame hands to the next."""
    (_, alone), seen = patient
    order = [0, 1, 1, 3, 2, 0, 3, 1]
    told: list[Frame] = []
    begun = [
        shared.begin(seen[place], number=n, elapsed_s=0.03, then=told.append)
        for n, place in enumerate(order)
    ]
    shared.settle()
    frames = [future.result() for future in begun]
    assert [id(frame) for frame in told] == [id(frame) for frame in frames]
    alone._auto_gain.gain = None
    for n, (place, frame) in enumerate(zip(order, frames, strict=True)):
        expected = alone.draw(seen[place], number=n, elapsed_s=0.03)
        assert frame.gain == expected.gain
        np.testing.assert_array_equal(frame.pixels, expected.pixels)


def test_what_fails_at_the_end_of_a_frame_is_raised_by_the_next(
    patient: Drawn, shared: EndoscopeView
) -> None:
    def fail(frame: Frame) -> None:
        raise OSError("the disk is full")

    _, seen = patient
    shared.begin(seen[0], number=0, elapsed_s=0.0, gain=0.7, then=fail)
    with pytest.raises(OSError, match="disk is full"):
        shared.begin(seen[1], number=1, elapsed_s=0.0, gain=0.7)
    shared.settle()
    shared.begin(seen[0], number=0, elapsed_s=0.0, gain=0.7, then=fail)
    with pytest.raises(OSError, match="disk is full"):
        shared.settle()
    shared.settle()
    expected = patient[0][0].draw(seen[1], number=1, elapsed_s=0.0, gain=0.7)
    frame = shared.draw(seen[1], number=1, elapsed_s=0.0, gain=0.7)
    np.testing.assert_array_equal(frame.pixels, expected.pixels)


def test_another_lens_is_another_view() -> None:
    from renderers.scene import Camera

    camera = Camera.looking_at((0.0, 0, 0), (0.0, 1, 0), size=(16, 16))
    assert camera.key == camera.moved(camera.frame.copy()).key
    others = [
        camera.with_size(16, 17),
        Camera(camera.frame, camera.extent * 1.1, 16, 16),
        Camera(camera.frame, camera.extent, 16, 16, distortion=Distortion(-0.1)),
        camera.moved(camera.frame + np.array([[1e-12], [0], [0], [0]])),
    ]
    assert len({camera.key, *(other.key for other in others)}) == 5


def test_a_tool_made_ready_is_not_cut_again_when_it_is_taken_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    EndoscopeView.prepare_tools(lambda: False)

    def cut(corners: NDArray[np.float64]) -> Facets:
        raise AssertionError("cut in flight")

    monkeypatch.setattr(Facets, "of", cut)
    monkeypatch.setattr(Spine, "through", cut)
    for name in INSTRUMENTS:
        for mesh, pose in placed_tool(name, np.eye(4), 0.5):
            assert len(mesh.facets().corners)
            mesh.spine(pose)


def test_whoever_ends_the_flight_waits_for_no_further_tool(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[Mesh] = []
    monkeypatch.setattr(Mesh, "facets", lambda mesh: made.append(mesh))
    monkeypatch.setattr(Mesh, "spine", lambda mesh, pose: None)
    answers = iter((False, True))
    EndoscopeView.prepare_tools(lambda: next(answers))
    first = next(iter(INSTRUMENTS))
    assert made == [mesh for mesh, _ in placed_tool(first, np.eye(4), 1.0)]
