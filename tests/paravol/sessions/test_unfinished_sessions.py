"""What a killed flight leaves is found, finished as it would have been, or removed."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from paravol.sessions.session_replay import read_session
from paravol.sessions.session_setup import build_session
from paravol.sessions.session_store import SessionStore, hold_session
from paravol.sessions.unfinished_sessions import discard, recover, unfinished_sessions
from system import UserError
from tests.paravol.trainee import hoops_flight

ROOT = Path(__file__).parents[3]


def killed_flight(
    folder: Path, created: str = "2026-01-02T03:04:05+00:00", count: int = 120
) -> Path:
    """Record, and cut the stream as a kill would: in a chunk, without an end."""
    flight = hoops_flight.begun(created)
    with flight.recorded(folder, has_end=False) as recorder:
        for number in range(count):
            flight.step(hoops_flight.sample(number))
        recorder.flush()
        there = (folder / "stream.mcap").read_bytes()
    (folder / "stream.mcap").write_bytes(there + b"\x06cut")
    return folder


def test_a_killed_flight_is_found_and_scored_as_if_it_had_ended(tmp_path: Path) -> None:
    scenario, patient = hoops_flight.scene()
    store = SessionStore(tmp_path)
    folder = killed_flight(tmp_path / "a.paravol")
    (found,) = unfinished_sessions(store)
    assert (found.folder, found.title) == (folder, scenario.title)
    assert found.length_s == hoops_flight.sample(119).time_s
    before = (folder / "stream.mcap").read_bytes()

    score = recover(found, patient=patient)

    session = build_session(scenario, patient, np.eye(4), (32, 32))
    for number in range(120):
        session.step(hoops_flight.sample(number))
    assert asdict(score) == asdict(session.score())
    assert read_session(folder).score == score
    assert json.loads((folder / "result.json").read_text())["recovered"] is True
    assert (folder / "stream.mcap").read_bytes() == before
    assert unfinished_sessions(store) == []
    assert os.listdir(tmp_path) == ["a.paravol"]


def test_the_newest_comes_first_and_what_is_none_is_left_out(tmp_path: Path) -> None:
    old = killed_flight(tmp_path / "b.paravol", "2026-01-01T00:00:00+00:00", 9)
    new = killed_flight(tmp_path / "a.paravol", "2026-02-01T00:00:00+00:00", 9)
    ended = killed_flight(tmp_path / "c.paravol", count=9)
    (ended / "result.json").write_text("{}")
    killed_flight(tmp_path / "nothing flown.paravol", count=0)
    broken = killed_flight(tmp_path / "broken.paravol", count=9)
    (broken / "stream.mcap").write_bytes(b"no stream of ours")
    held = killed_flight(tmp_path / "held.paravol", count=9)
    store = SessionStore(tmp_path)
    with hold_session(held):
        assert [s.folder for s in unfinished_sessions(store)] == [new, old]
    assert len(unfinished_sessions(store)) == 3
    assert unfinished_sessions(SessionStore(tmp_path / "none")) == []


def test_what_another_program_has_in_hand_is_left_to_it(tmp_path: Path) -> None:
    folder = killed_flight(tmp_path / "a.paravol", count=9)
    (found,) = unfinished_sessions(SessionStore(tmp_path))
    with hold_session(folder):
        with pytest.raises(UserError, match="being recorded"):
            recover(found, patient=hoops_flight.scene()[1])
        with pytest.raises(UserError, match="cannot be removed"):
            discard(found)
    assert folder.exists()
    discard(found)
    assert list(tmp_path.iterdir()) == []


def test_the_command_lists_finishes_and_removes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    sessions = tmp_path / "paravol" / "sessions"
    first = killed_flight(sessions / "a.paravol", count=31)
    other = killed_flight(sessions / "b.paravol", count=31)
    assert main(["unfinished"]) == 0
    told = capsys.readouterr().out
    assert str(first) in told
    assert ": 1.5 s" in told
    assert main(["unfinished", str(first), "--recover", "--no-store"]) == 0
    assert "path length" in capsys.readouterr().out
    assert main(["unfinished", "--discard"]) == 0
    assert "Removed" in capsys.readouterr().out
    assert not other.exists()
    assert (first / "result.json").exists()
    assert main(["unfinished"]) == 0
    assert "No flight was left unfinished." in capsys.readouterr().out
    assert main(["unfinished", "--recover", "--discard"]) == 1
    assert main(["unfinished", str(first), "--recover"]) == 1
    assert "was finished" in capsys.readouterr().err


FLY = """
import sys, time
from pathlib import Path
from paravol.exercises.exercise_path import recorded_path, recorded_path_file
from paravol.flight.flight import Flight, FlightOrder
from paravol.flight.flight_loop import FrameEvent
from paravol.inputs import choose_input
from paravol.sessions.session_store import SessionStore
from scenarios import load_scenario

def hear(event):
    if isinstance(event, FrameEvent) and event.sample.time_s > 1.5:
        print("flown", flush=True)

scenario, folder = load_scenario("hoops")
mouse = choose_input(None, None, scenario, None, None)
store = SessionStore(Path(sys.argv[1]))
Flight(FlightOrder(scenario, None, mouse, 64, 1, None, kept=store), hear).run()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="nothing there kills like this")
def test_a_flight_that_is_killed_is_recovered(tmp_path: Path) -> None:
    store = SessionStore(tmp_path / "sessions")
    with subprocess.Popen(
        [sys.executable, "-c", FLY, str(store.folder)], cwd=ROOT, stdout=subprocess.PIPE
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"flown\n"
        # it is being recorded: nobody takes it for a wreck
        assert unfinished_sessions(store) == []
        assert store.sessions() != []
        time.sleep(0.5)
        child.send_signal(signal.SIGKILL)
        child.wait()
    (found,) = unfinished_sessions(store)
    assert found.length_s > 1.0
    score = recover(found, patient=hoops_flight.scene()[1])
    assert score.duration_s == found.length_s
    assert unfinished_sessions(store) == []
