"""The emulated arm on the command line, as other people's software meets it."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
import pytest
import serial

from app.__main__ import main
from app.cli.emulator_command import load_motion
from devices import ProbePath, save_probe_path
from devices.microscribe.emulator.faults.catalogue import parse_fault
from scenarios import Sample
from scenarios.bundle import SampleRecord
from tests.recorded_flight import write_records
from tests.scenarios.session_info import INFO

if sys.platform == "win32":
    pytest.skip("pseudo-terminals need POSIX", allow_module_level=True)


@contextmanager
def emulator(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start the command; give it and the port that it prints."""
    command = [sys.executable, "-W", "error", "-m", "app", "emulator", *words]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        try:
            yield child, child.stdout.readline().strip()
        finally:
            child.kill()


def poll(port: str, count: int) -> bytes:
    with serial.serial_for_url(port, 115200, timeout=5.0) as client:
        client.write(b"\xc5IMMC")
        assert client.read(4) == b"IMMC"
        client.write(b"BEGIN")
        assert client.read(5) == b"MSCR\0"
        heard = b""
        for _ in range(count):
            client.write(b"\x03")
            heard += client.read(14)
        client.write(b"\xc7EMU00001\0\xc5")
        assert client.read(3) == b"\xc7\x00\xc5"
    return heard


def test_it_prints_its_port_and_ctrl_c_ends_it_cleanly(tmp_path: Path) -> None:
    link, log = tmp_path / "arm", tmp_path / "line.txt"
    words = ("--profile", "dx", "--motion", "orbit", "--fault", "f8=0@packet:3")
    with emulator(*words, "--link", str(link), "--transcript", str(log)) as (
        child,
        port,
    ):
        assert os.path.samefile(link, port)
        heard = poll(str(link), 2)
        assert heard[::14] == b"\x83\x83"
        child.send_signal(signal.SIGINT)
        assert child.wait(5.0) == 0
        assert child.stderr is not None
        told = child.stderr.read()
    assert "Traceback" not in told
    assert "f8_dropped_byte happened 0 times." in told
    assert "1 attempts to rewrite the calibration memory were refused." in told
    assert not link.is_symlink()
    assert re.search(r"\t>\tSYNC\tC5 49 4D 4D 43\t", log.read_text())


@pytest.mark.slow
def test_for_machines_every_line_is_an_object(tmp_path: Path) -> None:
    fault, action = "f8=0@packet:3", "right_pedal@50"
    words = ("--motion", "rest", "--fault", fault, "--do", action, "--json")
    with emulator(*words) as (child, line):
        told = json.loads(line)
        assert told["profile"] == "dx40937"
        assert (told["faults"], told["actions"]) == ([fault], [action])
        poll(told["port"], 5)
        child.send_signal(signal.SIGINT)
        assert child.wait(5.0) == 0
        assert child.stdout is not None
        assert child.stderr is not None
        (last,) = child.stdout.read().splitlines()
        assert child.stderr.read() == ""
    assert json.loads(last) == {
        "fired": {"f8_dropped_byte": 1},
        "memory_writes": 1,
        "memory_writes_granted": False,
    }


def test_it_listens_for_this_machine_and_ends_when_unplugged() -> None:
    words = ("--listen", "0", "--motion", "rest", "--fault", "unplug@packet:3")
    with emulator(*words) as (child, port):
        assert re.fullmatch(r"socket://127\.0\.0\.1:\d+", port)
        with pytest.raises(OSError, match=r"."):
            poll(port, 9)
        assert child.wait(5.0) == 0


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--fault", "droped_byte@1"], "nearest is 'dropped_byte'"),
        (["--profile", "dy"], "profile must be one of"),
        (["--do", "unplugg@1"], "nearest is 'unplug'"),
        (["--motion", "dance"], "motion must be one of orbit, rest"),
        (["--probe-path", "x.path.json", "--motion", "rest"], "not both"),
        (["--probe-path", "nowhere.path.json"], "cannot be read"),
        (["--motion", "rest", "--listen", "x"], "PORT or HOST:PORT"),
        (["--motion", "rest", "--sync-repeats", "0"], "sync_repeats"),
    ],
)
def test_mistakes_are_one_sentence(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["emulator", *words]) == 1
    (told,) = capsys.readouterr().err.strip().splitlines()
    assert told.startswith("paravol: ")
    assert complaint in told


def test_the_lists_name_everything(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["emulator", "--list-faults", "--list-actions"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert [n for n in names if re.match(r"f\d+_", n)] == sorted(
        (n for n in names if re.match(r"f\d+_", n)),
        key=lambda n: int(n[1 : n.index("_")]),
    )
    assert {"f1_never_answers", "f30_slow", "garbage", "home_button"} <= set(names)


def test_the_lists_can_be_read_by_machines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["emulator", "--list-faults", "--list-actions", "--json"]) == 0
    lists = json.loads(capsys.readouterr().out)
    assert lists.keys() == {"faults", "actions"}
    for name in lists["faults"]:
        parse_fault(name)
    assert "unplug" in lists["actions"]


def test_help_teaches_by_examples(capsys: pytest.CaptureFixture[str]) -> None:
    main(["emulator", "--help"])
    told = capsys.readouterr().out
    examples = [
        line for line in told.splitlines() if "  paravol emulator" in f" {line}"
    ]
    assert len(examples) >= 6
    for example in examples:
        for fault in re.findall(r"--fault (\S+)", example):
            parse_fault(fault)


def test_a_path_file_is_a_motion(tmp_path: Path) -> None:
    t_s = np.array((0.0, 1.0))
    rows = np.array(((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)))
    axis = np.array(((0.0, 1.0, 0.0), (0.0, 1.0, 0.0)))
    zeros = np.zeros(2)
    path = ProbePath("p", t_s, rows, axis, zeros, rows, axis, zeros.astype(np.int64))
    save_probe_path(path, tmp_path / "p.path.json")
    assert np.array_equal(load_motion(tmp_path / "p.path.json").tip_mm, rows)
    with pytest.raises(ValueError, match="not a session"):
        load_motion(tmp_path)


def test_a_recorded_session_is_a_motion(tmp_path: Path) -> None:
    """The way of the tip in the patient, wherever the arm stood."""
    turn = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    world_from_device = np.eye(4)
    world_from_device[:3, :3], world_from_device[:3, 3] = turn, (5.0, 6.0, 7.0)
    place = world_from_device.ravel().tolist()
    info = msgspec.structs.replace(INFO, world_from_device=place)
    forward = np.array((0.0, 1.0, 0.0))
    records = []
    for time_s, x, buttons in ((-1.0, 0.0, 1), (2.0, 1.0, 2), (2.5, 2.0, 3)):
        pose = np.eye(4)
        pose[0, 3] = x
        sample = Sample(time_s, pose, 10.0 * x, forward, forward, buttons)
        records.append(SampleRecord.of(sample))
    path = load_motion(write_records(tmp_path / "f.paravol", info, records))
    assert path.name == "f"
    assert path.t_s.tolist() == [0.0, 0.5]
    assert path.tip_mm.tolist() == [[5.0, 7.0, 7.0], [5.0, 8.0, 7.0]]
    assert path.axis.tolist() == [[0.0, 0.0, -1.0]] * 2
    assert path.roll_deg.tolist() == [10.0, 20.0]
    assert path.buttons.tolist() == [0, 1], "the arm presses the path's pedal itself"


def test_a_session_without_a_flight_is_refused(tmp_path: Path) -> None:
    """Nothing to follow: only samples from before the flight."""
    forward = np.array((0.0, 1.0, 0.0))
    before = SampleRecord.of(Sample(-1.0, np.eye(4), 0.0, forward, forward, 0))
    folder = write_records(tmp_path / "e.paravol", INFO, [before])
    with pytest.raises(ValueError, match="no flight"):
        load_motion(folder)
