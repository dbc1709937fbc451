"""The nouns of exchange: what is a pose, which ones follow, which side is which."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from paravol.exchange.tool_motion import (
    INSTRUMENT,
    SCOPE,
    are_poses,
    motions_of,
    ras_from_lps,
    tool_named,
)
from scenarios import Sample, tip_frame
from scenarios.bundle import EventRecord, Recording, SampleRecord
from scenarios.instrument_state import EMPTY_HAND
from system import UserError
from tests.paravol.exchange.made_motion import motion, motions
from tests.scenarios.session_info import INFO


def test_ras_is_right_and_anterior() -> None:
    """A tip at the patient's left front: LPS (+20, -30, 40) is RAS (-20, +30, 40)."""
    frame = tip_frame(np.array([20.0, -30.0, 40.0]), np.array([0.0, 1.0, 0.0]))
    turned = ras_from_lps(frame[None])[0]
    assert turned[:3, 3].tolist() == [-20.0, 30.0, 40.0]
    # it points to the back, and +z goes back up the shaft: to the front
    assert turned[:3, 2].tolist() == [0.0, 1.0, 0.0]
    assert np.linalg.det(turned[:3, :3]) == pytest.approx(1.0)
    frames = motion("a").world_from_tool
    assert np.array_equal(ras_from_lps(ras_from_lps(frames)), frames)
    assert not np.array_equal(ras_from_lps(frames), frames)


def test_what_is_no_pose() -> None:
    good = np.tile(np.eye(4), (7, 1, 1))
    good[1, 0, 0] = np.nan
    good[2, 0, 0] = 1.1
    good[3, 0, 0] = -1.0  # a mirror
    good[4, 3, 0] = 1.0
    good[5, 0, 0] = 1e300
    good[6, 1, 3] = 1e9
    assert are_poses(good).tolist() == [True] + 6 * [False]


def test_times_that_do_not_go_on_are_left_out() -> None:
    tool = motion("a", 8)
    times = np.array([0.0, 1.0, np.nan, 5.0, 2.0, 9.0, 5.0, 6.0])
    # 4 is invalid by count // 2, 5 by the other; 6 and 7: 5 s again, then on
    assert replace(tool, time_s=times).rising.tolist() == [0, 1, 3, 7]
    empty = replace(tool, valid=np.zeros(8, np.bool_))
    assert empty.rising.tolist() == []


def test_a_session_gives_scope_and_tool_in_the_patient() -> None:
    matrix = tip_frame(np.array([3.0, 1.0, -2.0]), np.array([0.6, 0.0, 0.8]))
    info = msgspec.structs.replace(INFO, world_from_device=matrix.ravel().tolist())
    way = np.array([0.0, 0.6, 0.8])
    wanted = tip_frame(np.array([9.0, -8.0, 7.0]), way, 25.0)
    tip = np.linalg.inv(matrix) @ tip_frame(np.array([9.0, -8.0, 7.0]), way)
    held = Sample(1.5, tip, 25.0, np.array([1.0, 2.0, 3.0]), way, 0)
    empty = replace(held, time_s=1.6, instrument=EMPTY_HAND)
    broken = replace(held, time_s=1.7, device_from_tip=np.full((4, 4), np.nan))
    records = [SampleRecord.of(s) for s in (held, empty, broken)]
    event = EventRecord(1.55, "task", "look: done")
    found = motions_of(Recording(info, [*records, event], True, (), {}))
    scope, tool = found.tools
    assert (scope.name, tool.name) == (SCOPE, INSTRUMENT)
    assert np.allclose(scope.world_from_tool[0], wanted, atol=1e-12)
    assert scope.valid.tolist() == [True, True, False]
    assert tool.valid.tolist() == [True, False, True]
    assert tool.world_from_tool[0, :3, 3].tolist() == [1.0, 2.0, 3.0]
    assert [(m.time_s, m.text) for m in found.messages] == [(1.55, "task: look: done")]


def test_nothing_is_no_motion() -> None:
    with pytest.raises(UserError, match="no sample"):
        motions_of(Recording(INFO, [], False, (), {}))
    with pytest.raises(UserError, match="ScopeTipToRas, InstrumentTipToRas"):
        tool_named(motions().tools, "StylusTipToRas")
    with pytest.raises(UserError, match="not a pose for each"):
        replace(motion("a", 8), time_s=np.zeros(9))
