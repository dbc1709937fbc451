"""`paravol score` and `paravol pass-mark`, with workers of their own where slow."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest

from app.__main__ import main
from paravol.patient import load_patient, no_progress
from scenarios import Sample, load_scenario, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from tests.mpi.launching import LAUNCHER, NEEDS_RANKS
from tests.recorded_flight import record

COUNT = 3
"""Sessions of each group."""


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record steady and shaking hands in a room that is quickly made."""
    place = tmp_path_factory.mktemp("groups")
    scenario, _ = load_scenario("hoops")
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    scenario = msgspec.structs.replace(scenario, head=head)
    patient = load_patient(scenario, no_progress)
    way, middle = np.array([0.0, 1.0, 0.0]), patient.scene.volume.center_mm
    for group, shake_mm in (("experts", 0.1), ("novices", 1.0)):
        for number in range(COUNT):
            rng = np.random.default_rng([number, round(10 * shake_mm)])
            folder = place / group / f"{number}.paravol"
            folder.parent.mkdir(exist_ok=True)
            samples = []
            for n in range(60):
                off = np.cumsum(rng.normal(size=3)) * shake_mm
                frame = tip_frame(middle + off + [0.0, 60 * np.sin(n / 20), 0.0], way)
                samples.append(
                    Sample(0.05 * n, frame, 0.0, 0 * way, way, 0, EMPTY_HAND)
                )
            record(folder, scenario, patient, samples, operates=False)
    return place


def lines(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as text:
        return list(csv.DictReader(text))


def test_a_folder_is_scored_to_a_table_and_no_session_twice(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = tmp_path / "kept", tmp_path / "scores.csv"
    words = ["score", str(sessions), "--out", str(out), "--csv", str(table)]
    assert main(words) == 0
    found = lines(table)
    assert [row["Session"] for row in found] == [
        f"{group}/{n}.paravol" for group in ("experts", "novices") for n in range(COUNT)
    ]
    assert {row["Exercise"] for row in found} == {"not passed"}
    assert all(0.0 <= float(row["Percent"]) <= 100.0 for row in found)
    # who reads the table alone knows what each line is of
    for row in found:
        assert row["ExerciseName"]
        assert row["Recorded"]
        assert any(name.startswith(f"{row['Rubric']} ") for name in row)
    before = {file: file.stat().st_mtime_ns for file in out.iterdir()}
    assert len(before) == 2 * COUNT
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out.partition("[")[2].join("[ "))
    assert len(told) == 2 * COUNT
    assert {file: file.stat().st_mtime_ns for file in out.iterdir()} == before


def test_a_damage_is_told_in_every_table(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "sessions"
    shutil.copytree(sessions / "experts", place)
    stream = place / "0.paravol" / "stream.mcap"
    content = bytearray(stream.read_bytes())
    content[len(content) // 3] ^= 0x40
    stream.write_bytes(content)
    table = tmp_path / "scores.csv"
    assert main(["score", str(place), "--csv", str(table)]) in (0, 1)
    told = capsys.readouterr().out
    first, *others = lines(table)
    assert "damaged" in first["Measured"]
    assert told.count("damaged") == 1
    assert not any("damaged" in row["Measured"] for row in others)


def test_a_part_without_data_is_told_without_markup_where_the_table_is_piped(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = sessions / "experts" / "0.paravol"
    assert main(["score", str(one), "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "not enough data" in told
    assert "dim]" not in told
    assert "\x1b" not in told
    assert main(["score", str(one), "--out", str(tmp_path), "--json"]) == 0
    (line,) = json.loads(capsys.readouterr().out)
    assert line["assessment"]["exercise"]["verdict"] == "not passed"
    assert line["assessment"]["exercise"]["missed"]


def test_a_mark_parts_groups_that_differ(
    sessions: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    groups = [str(sessions / "novices"), str(sessions / "experts")]
    chosen = ["--metric", "path length", "--role", "scope", "--json"]
    assert main(["pass-mark", *groups, *chosen]) == 0
    told = capsys.readouterr().out
    mark = json.loads(told[told.index("{") :])
    assert mark["passes_above"] is False
    assert mark["experts"]["mean"] < mark["mark"] < mark["novices"]["mean"]
    assert mark["experts"]["count"] == COUNT
    assert main(["pass-mark", *groups]) == 1
    assert "--metric" in capsys.readouterr().err


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "app", *map(str, words)]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_workers_that_are_killed_leave_lines_to_go_on_from(
    sessions: Path, tmp_path: Path
) -> None:
    out, table = tmp_path / "kept", tmp_path / "scores.csv"
    words = command("score", sessions, "--jobs", 2, "--out", out, "--csv", table)
    killed = subprocess.Popen(words, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        deadline = time.monotonic() + 200
        while not (out.is_dir() and any(out.glob("*.json"))):
            assert time.monotonic() < deadline
            assert killed.poll() is None
            time.sleep(0.02)
    finally:
        os.killpg(killed.pid, signal.SIGKILL)
        killed.wait()
    assert not table.exists()
    before = {f: f.stat().st_mtime_ns for f in out.glob("*.json")}
    assert before
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, timeout=200)
    assert len(lines(table)) == 2 * COUNT
    assert all(f.stat().st_mtime_ns == at for f, at in before.items())
    alone = tmp_path / "alone.csv"
    assert main(["score", str(sessions), "--out", f"{out}2", "--csv", str(alone)]) == 0
    assert alone.read_bytes() == table.read_bytes()


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.timeout(300)
@NEEDS_RANKS[1]
@NEEDS_RANKS[2]
def test_ranks_score_what_one_process_scores(sessions: Path, tmp_path: Path) -> None:
    alone, table = tmp_path / "alone.csv", tmp_path / "ranks.csv"
    assert (
        main(["score", str(sessions), "--out", f"{alone}s", "--csv", str(alone)]) == 0
    )
    assert LAUNCHER is not None
    words = ["score", sessions, "--mpi", "--out", tmp_path / "kept", "--csv", table]
    ranks = [sys.executable, "-m", "mpi4py.futures", "-m", "app", *map(str, words)]
    done = subprocess.run(
        [*LAUNCHER.command(3), *ranks],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert table.read_bytes() == alone.read_bytes()
