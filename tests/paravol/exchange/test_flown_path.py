"""Recordings of other programs become paths that fly as the tools moved."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from paravol.exchange.flown_path import Pointing, path_of, read_motions
from paravol.exchange.perktutor import write_perktutor
from paravol.exchange.sequence_file import write_sequence
from paravol.exchange.tool_motion import Motions
from scenarios import tip_frame
from system import UserError
from tests.paravol.exchange.made_motion import motion, motions


@pytest.mark.parametrize("name", ["a.xml", "a.seq.mha", "a.seq.nrrd"])
def test_a_path_has_the_poses_of_the_file(tmp_path: Path, name: str) -> None:
    """Tip, axis and roll: the whole frame comes back, of both tools."""
    file, written = tmp_path / name, motions()
    (write_perktutor if name.endswith("xml") else write_sequence)(file, written)
    path = path_of(
        read_motions(file), "p", scope="ScopeTipToRas", instrument="InstrumentTipToRas"
    )
    scope, tool = written.tools
    places = scope.rising
    assert len(path.t_s) == len(places) == scope.valid.sum()
    assert np.allclose(path.t_s, scope.time_s[places] - scope.time_s[0], atol=1e-8)
    for row, place in enumerate(places):
        frame = tip_frame(path.tip_mm[row], path.axis[row], float(path.roll_deg[row]))
        assert np.allclose(frame, scope.world_from_tool[place], atol=1e-9)
        if tool.valid[place]:
            at = tool.world_from_tool[place]
            assert np.allclose(path.instrument_tip_mm[row], at[:3, 3], atol=1e-6)
            assert np.allclose(path.instrument_axis[row], -at[:3, 2], atol=1e-6)


@pytest.mark.parametrize("pointing", get_args(Pointing))
def test_a_tool_may_point_along_any_axis_of_its_own(pointing: Pointing) -> None:
    tool = motion("Stylus")
    path = path_of(Motions((tool,)), "p", pointing=pointing)
    own = np.zeros(3)
    own["xyz".index(pointing[1])] = 1.0 if pointing[0] == "+" else -1.0
    wanted = tool.world_from_tool[tool.rising][:, :3, :3] @ own
    assert np.allclose(path.axis, wanted, atol=1e-9)


def test_lps_files_are_not_turned(tmp_path: Path) -> None:
    write_sequence(tmp_path / "a.seq.mha", motions())
    ras = path_of(read_motions(tmp_path / "a.seq.mha", "ras"), "p")
    lps = path_of(read_motions(tmp_path / "a.seq.mha", "lps"), "p")
    assert np.array_equal(lps.tip_mm, ras.tip_mm * [-1.0, -1.0, 1.0])


def test_a_clock_that_runs_backwards_leaves_samples_out() -> None:
    tool = motion("a", 20)
    times = tool.time_s.copy()
    times[7:12] -= 50.0
    path = path_of(Motions((replace(tool, time_s=times),)), "p")
    assert len(path.t_s) == 20 - 1 - 5  # one invalid, five that are not later
    assert (np.diff(path.t_s) > 0).all()


def test_what_cannot_be_flown_is_refused(tmp_path: Path) -> None:
    tool = motion("a", 20)
    with pytest.raises(UserError, match="0 valid poses"):
        path_of(Motions((replace(tool, valid=np.zeros(20, np.bool_)),)), "p")
    with pytest.raises(UserError, match="those there are: a, b"):
        path_of(Motions((tool, motion("b"))), "p")
    with pytest.raises(UserError, match="no recording that can be read"):
        read_motions(tmp_path / "a.docx")
