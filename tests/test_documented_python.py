"""The Python in README.md and docs/python.md runs, and draws the inside of a nose."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import paravol
from paravol.patient import load_phantom
from paravol.sessions.session_setup import build_session, build_view
from scenarios import Sample, Scenario
from scenarios.instrument_state import EMPTY_HAND
from scenarios.scenario import Head
from tests.recorded_flight import Flight

ROOT = Path(__file__).parents[1]
SIZE = 48


def record_flight(folder: Path, frames: int = 3) -> None:
    """Record a few frames along the bundled path, as a flight does."""
    scenario = Scenario("short", "Short", head=Head(seed=1, spacing_mm=1.0))
    flight = Flight(scenario, load_phantom(1, 1.0, average=True), size=SIZE)
    with flight.recorded(folder):
        for number in range(frames):
            pose, _ = paravol.flight_pose(9.0 + 0.1 * number)
            at_s, ahead = 0.1 * number, np.eye(3)[1]
            flight.step(Sample(at_s, pose, 0.0, np.zeros(3), ahead, 0, EMPTY_HAND))
            flight.show(SIZE, elapsed_s=0.1)


@pytest.mark.parametrize(
    "page", ["README.md", pytest.param("docs/python.md", marks=pytest.mark.slow)]
)
def test_what_a_page_says_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every block, in order, one after the other in one namespace."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert blocks
    monkeypatch.chdir(tmp_path)
    record_flight(tmp_path / "flight.paravol")
    said: dict[str, Any] = {}
    for number, block in enumerate(blocks):
        exec(compile(block, f"{page}, block {number + 1}", "exec"), said)
    report = said["report"]
    assert report.is_exact
    assert (report.frames, report.samples) == (3, 3)
    live, rays, fine = said["live"], said["rays"], said["fine"]
    for look in (live, rays, fine):
        red, green, _ = look.rgb.reshape(-1, 3).mean(axis=0)
        assert red > 1.2 * green  # mucosa
        assert look.rgb.std() > 20
        assert (look.rgb.dtype, look.depth_mm.dtype) == (np.uint8, np.float32)
    met = np.isfinite(live.depth_mm) & np.isfinite(rays.depth_mm)
    assert met.mean() > 0.6
    assert np.median(np.abs(live.depth_mm[met] - rays.depth_mm[met])) < 0.1
    assert fine.difference.ssim > 0.9


def test_a_look_is_the_trainers_own_picture() -> None:
    """To the bit: the same splats, light, tool and camera."""
    patient = paravol.phantom(average=True, spacing_mm=1.0)
    pose, tool = paravol.flight_pose(9.5)
    scenario = Scenario("same", "Same", "none")
    view = build_view(scenario, patient, threads=1)
    session = build_session(scenario, patient, np.eye(4), (SIZE, SIZE))
    tip, pointing = tool[:3, 3], -tool[:3, 2]
    seen = session.view(Sample(0.0, pose, 0.0, tip, pointing, 0))
    look = patient.look(pose, size=SIZE, instrument_pose=tool)
    frame = view.draw(seen, number=0, elapsed_s=0.0, gain=look.gain)
    assert np.array_equal(look.rgb, frame.pixels)
    assert np.array_equal(look.depth_mm, frame.gbuffer.depth_mm)
    bare = patient.look(pose, size=SIZE, gain=look.gain)
    assert not np.array_equal(look.rgb, bare.rgb)


def test_a_face_loads_nothing_before_it_is_used() -> None:
    code = "import paravol, sys; print('numpy' in sys.modules, paravol.__all__)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True
    )
    assert done.stdout.startswith("False ")
    assert all(callable(getattr(paravol, name)) for name in paravol.__all__)
    with pytest.raises(AttributeError, match="no attribute 'fantom'"):
        paravol.fantom  # type: ignore[attr-defined]  # noqa: B018


def test_mistakes_are_told_in_a_sentence(tmp_path: Path) -> None:
    patient = paravol.phantom(average=True, spacing_mm=1.0)
    with pytest.raises(ValueError, match="no landmark 'nose'; it has: "):
        patient.pose("nose", "nasopharynx")
    with pytest.raises(ValueError, match="one place"):
        patient.pose("nasopharynx", "nasopharynx")
    wrong: Any = "rays"
    with pytest.raises(ValueError, match="'fsr' or 'art', got 'rays'"):
        patient.look(patient.pose("nostril, right", "nasopharynx"), renderer=wrong)
    with pytest.raises(ValueError, match="there are: suction tube"):
        paravol.instrument("drill")
    for read in (paravol.load, paravol.read_session, paravol.replay):
        with pytest.raises(ValueError, match=str(tmp_path)):
            read(tmp_path)
