import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.endoscope import Endoscope, tip_frame
from scenarios.instrument_state import EMPTY_HAND, InstrumentState
from scenarios.metrics import Measured, Track
from scenarios.metrics.recorded import (
    rolled_frames,
    scope_changes,
    scope_track,
    tool_track,
    tool_use,
)
from scenarios.metrics.scope_view import views_of
from scenarios.metrics.settings import Settings
from scenarios.metrics.track import Piece, second_column
from scenarios.sample import Sample, tool_frame
from scenarios.sample_columns import SampleColumns
from tests.scenarios.recorded_hand import ABOVE

UNIT = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def sample(time_s: float, **more: object) -> Sample:
    values = {
        "device_from_tip": ABOVE,
        "roll_deg": 0.0,
        "instrument_tip_mm": np.array([1.0, 2.0, 3.0]),
        "instrument_pointing": np.array([0.1, 0.9, 0.2]),
        "buttons": 0,
    }
    return Sample(time_s, **{**values, **more})  # type: ignore[arg-type]


@given(
    UNIT,
    st.floats(-180, 180),
    st.sampled_from([0.0, 30.0, 45.0, 70.0]),
    st.sampled_from([0.0, 20.0, -135.0]),
)
def test_views_are_those_of_the_scopes_camera(
    pointing: tuple[float, float, float],
    roll_deg: float,
    angle_deg: float,
    camera_deg: float,
) -> None:
    scope = Endoscope(angle_deg=angle_deg)
    pose = tip_frame(np.array([5.0, 6.0, 7.0]), np.array(pointing))
    turns = {"roll_deg": roll_deg, "camera_roll_deg": camera_deg}
    held = [sample(t, device_from_tip=pose, **turns) for t in (0.0, 1.0)]
    track = scope_track(SampleColumns.of(held), np.eye(4))
    tips = np.tile(pose[:3, 3], (2, 1))
    piece = Piece(0.0, 1.0, tips, track.quaternion, track.camera_deg)
    camera = scope.camera(pose, roll_deg, (64, 64), camera_deg)
    views = views_of(scope, piece)
    if abs(abs(camera.frame[3, 2]) - 0.999) < 1e-6:
        return  # where "up" changes its meaning rounding decides
    assert views.forward[0] == pytest.approx(camera.frame[3], abs=1e-7)
    assert views.right[0] == pytest.approx(camera.frame[1], abs=1e-4)
    assert views.up[0] == pytest.approx(camera.frame[2], abs=1e-4)


@given(UNIT, st.floats(-180, 180))
def test_tools_are_posed_as_they_are_drawn(
    pointing: tuple[float, float, float], roll_deg: float
) -> None:
    state = InstrumentState(roll_deg=roll_deg)
    held = sample(0.0, instrument_pointing=np.array(pointing), instrument=state)
    frame = tool_frame(held)
    track = tool_track(SampleColumns.of([held]))
    assert second_column(track.quaternion)[0] == pytest.approx(frame[:3, 1], abs=1e-9)
    assert track.tip_mm[0] == pytest.approx(frame[:3, 3])


def test_each_piece_of_a_scopes_track_knows_which_scope_it_was() -> None:
    """A target 30 degrees above the shaft is in the middle of the 30-degree scope."""
    held = [sample(0.01 * n, scope_deg=30.0 if n >= 50 else None) for n in range(100)]
    assert scope_changes(SampleColumns.of(held), 0.0) == ((held[50].time_s, 30.0),)
    assert scope_changes(SampleColumns.of(held), 30.0) == ()
    measured = Measured(
        scope_track(SampleColumns.of(held), np.eye(4)),
        Track.none(),
        Endoscope(angle_deg=0.0),
        scope_changes=scope_changes(SampleColumns.of(held), 0.0),
    )
    first, second = measured.scope_pieces
    angles = [measured.endoscope_of(piece).angle_deg for piece in (first, second)]
    assert angles == [0.0, 30.0]
    ways = [
        views_of(measured.endoscope_of(piece), piece).forward[0]
        for piece in (first, second)
    ]
    assert np.degrees(np.arccos(ways[0] @ ways[1])) == pytest.approx(30.0)
    # nothing of the session's time is lost but the change itself
    assert sum(e - b for b, e in measured.spans("scope")) == pytest.approx(0.98)


def test_a_tool_is_used_while_it_works_or_sucks_and_nothing_is_frozen() -> None:
    states = [
        InstrumentState("curette"),
        InstrumentState("curette", is_working=True),
        InstrumentState("suction tube", is_sucking=True),
        EMPTY_HAND,
    ]
    held = [sample(t, instrument=state) for t, state in enumerate(states)]
    frozen = sample(4.0, instrument=states[1], is_frozen=True)
    use = tool_use(SampleColumns.of([*held, frozen]))
    assert {name: used.tolist() for name, used in use.is_used.items()} == {
        "curette": [False, True, False, False, False],
        "suction tube": [False, False, True, False, False],
    }


def test_an_empty_hand_has_no_samples_and_another_tool_is_another_part() -> None:
    curette = InstrumentState("curette")
    names = [InstrumentState(), EMPTY_HAND, curette, curette]
    held = [sample(t, instrument=state) for t, state in enumerate(names)]
    track = tool_track(SampleColumns.of(held))
    assert track.time_s.tolist() == [0.0, 2.0, 3.0]
    assert [len(p) for p in track.spans(5.0)] == [1, 2]


def test_what_was_frozen_is_on_no_track() -> None:
    curette = InstrumentState("curette")
    stands = [False, False, True, True, False, False]
    samples = SampleColumns.of(
        [
            sample(0.01 * n, instrument=curette, is_frozen=frozen)
            for n, frozen in enumerate(stands)
        ]
    )
    for track in (scope_track(samples, np.eye(4)), tool_track(samples)):
        assert track.time_s == pytest.approx([0.0, 0.01, 0.04, 0.05])
        # short as it was, the time between counts no more than the way
        assert [len(p) for p in track.spans(5.0)] == [2, 2]
    frozen = SampleColumns.of([sample(0.0, is_frozen=True)])
    assert scope_track(frozen, np.eye(4)).pieces(Settings()) == []


def test_without_samples_there_is_an_empty_track() -> None:
    none = SampleColumns.of([])
    for track in (scope_track(none, np.eye(4)), tool_track(none)):
        assert track.pieces(Settings()) == []


def test_a_pose_that_is_none_is_dropped() -> None:
    lost = sample(1.0, device_from_tip=np.full((4, 4), np.nan))
    track = scope_track(SampleColumns.of([sample(0.0), lost, sample(2.0)]), np.eye(4))
    assert track.valid.tolist() == [0, 2]


def test_the_frames_are_rotations() -> None:
    rng = np.random.default_rng(3)
    frames = rolled_frames(
        rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), rng.uniform(-180, 180, 50)
    )
    turns = frames[:, :3, :3]
    identity = np.broadcast_to(np.eye(3), turns.shape)
    assert turns @ turns.transpose(0, 2, 1) == pytest.approx(identity, abs=1e-12)
    assert np.linalg.det(turns) == pytest.approx(1.0)
