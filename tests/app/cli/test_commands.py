"""The command line: help, and one sentence for every mistake."""

import errno
import fcntl
import json
import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import pytest

from app.__main__ import main
from app.cli.debrief_command import debrief
from app.cli.overview import overview
from app.cli.renamed_options import RENAMED
from app.cli.root import GROUPS, app
from app.errors import sentence
from paravol.debrief import DebriefOrder

SESSION = Path(__file__).parents[2] / "accuracy" / "before_the_move.paravol"


def told(capsys: pytest.CaptureFixture[str]) -> str:
    """Give the one sentence on standard error; fail when there is more."""
    lines = [
        line
        for line in capsys.readouterr().err.strip().splitlines()
        if not line.endswith("...")
    ]
    assert len(lines) == 1, lines
    assert lines[0].startswith("paravol: ")
    assert "Traceback" not in lines[0]
    return lines[0]


def test_overview_lists_every_command_with_its_first_line() -> None:
    names = {name for name in app if not name.startswith("-")}
    listed = dict(re.findall(r"^  ([\w-]+) +(\S.*)$", overview(), re.MULTILINE))
    assert set(listed) == names
    assert len(names) >= 9
    for name, line in listed.items():
        assert (app[name].help or "").startswith(line.rstrip("."))


def test_every_command_stands_in_its_group() -> None:
    parts = re.split(r"^(\w+):$", overview(), flags=re.MULTILINE)[1:]
    listed = {
        name: group
        for group, text in zip(parts[::2], parts[1::2], strict=True)
        for name in re.findall(r"^  ([\w-]+) ", text, re.MULTILINE)
    }
    for name in (name for name in app if not name.startswith("-")):
        assert app[name].group == (GROUPS[listed[name]],)


def test_options_of_a_snapshot_stand_in_groups(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["snapshot", "--help"]) == 0
    shown = capsys.readouterr().out
    names = ("What is shown", "Camera", "Film", "Quality", "Path tracing", "Output")
    places = [shown.index(name) for name in names]
    assert places == sorted(places)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_every_command_and_the_options(
    shell: Literal["bash", "zsh", "fish"],
) -> None:
    script = app.generate_completion(shell=shell)
    for name in (name for name in app if not name.startswith("-")):
        assert re.search(rf"\b{name}\b", script)
    assert "camera-path" in script


@pytest.mark.parametrize(("command", "old"), list(RENAMED))
def test_an_old_name_is_refused_with_the_new_one(
    command: str, old: str, capsys: pytest.CaptureFixture[str]
) -> None:
    new = RENAMED[command, old]
    for words in ([command, old, "x"], [command, f"{old}=x"]):
        assert main(words) == 2
        line = told(capsys)
        assert f"{old} is called {new} now." in line
        assert line.endswith(f"See paravol {command} --help.")
    names = {
        n for each in app[command].assemble_argument_collection() for n in each.names
    }
    assert new in names
    assert old not in names


@pytest.mark.parametrize("words", [[], ["--help"], ["-h"]])
def test_help_ends_well(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 0
    assert "paravol demo" in capsys.readouterr().out


HELP_OF_ALL = """
import sys
from app.__main__ import main
from app.cli.root import app

def ask(command, words):
    assert main([*words, "--help"]) == 0
    heavy = {"numpy", "numba", "vtkmodules", "PySide6"} & {*sys.modules}
    assert not heavy, f"paravol {' '.join(words)} --help loads {heavy}"
    for name in command:
        if not name.startswith("-"):
            ask(command[name], [*words, name])

ask(app, [])
"""


def test_help_loads_nothing_heavy() -> None:
    """Everything of ours that takes long to load begins with numpy."""
    words = [sys.executable, "-c", HELP_OF_ALL]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "paravol progress curve" in done.stdout


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["demo", "--scenario", "nose-job"], "no scenario named 'nose-job'"),
        (["demo", "--scenario", "none.toml"], "cannot be read"),
        (["demo", "--size", "65"], "--size must be even"),
        (["replay", "nowhere.paravol"], "is not a session"),
        (["snapshot"], "either a session folder or --case or --volume"),
        (["snapshot", "--case", "a", "--volume", "b.nrrd"], "one of them alone"),
        (["snapshot", "--case", "a", "--eye", "0", "0", "0"], "go together"),
        (
            [
                "snapshot",
                "s.paravol",
                "--eye",
                "0",
                "0",
                "0",
                "--target",
                "0",
                "1",
                "0",
            ],
            "belong to --case",
        ),
        (["snapshot", "--volume", "scan.nrrd"], "--eye"),
        (["phantom", "--out", "x", "--spacing", "0"], "spacing"),
    ],
)
def test_mistakes_are_one_sentence(
    words: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 1
    assert complaint in told(capsys)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["demo", "--threads", "-1"], '"-1" for --threads'),
        (["train", "--threads", "-1"], '"-1" for --threads'),
        (["demo", "--ranks", "0"], '"0" for --ranks'),
        (["snapshot", "--size", "-5"], '"-5" for --size'),
        (["register", "--seed", "-1"], '"-1" for --seed'),
        (["phantom", "--out", "x", "--seed", "-1"], '"-1" for --seed'),
        (["emulator", "--seed", "-1"], '"-1" for --seed'),
        (["phantom", "--out", "x", "--spacing", "wide"], '"wide" into float'),
        (["export", "x", "--out", "y", "--format", "obj"], '"ply", "vtp", "stl"'),
        (["slices", "x", "--empty-at"], "--empty-at"),
    ],
)
def test_words_that_are_not_understood_name_the_help(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    line = told(capsys)
    assert complaint in line
    assert line.endswith(f"See paravol {words[0]} --help.")


def test_an_unknown_command_names_those_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["serve"]) == 2
    assert 'Unknown command "serve"' in told(capsys)


def test_the_version_is_the_package_s(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == version("paravol-ess")


def test_ctrl_c_while_a_command_loads(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt() -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr("paravol.environment.prepare_environment", interrupt)
    assert main(["phantom", "--out", "x"]) == 130
    assert capsys.readouterr().err == "Interrupted.\n"


def test_too_little_memory_is_told() -> None:
    said = sentence(MemoryError("Unable to allocate 1.42 TiB"))
    assert said is not None
    assert "1.42 TiB" in said
    assert "--size" in said


def test_what_the_disk_refuses_is_told_with_a_remedy() -> None:
    absent = FileNotFoundError(errno.ENOENT, "No such file or directory", "/proc/x")
    said = "No such file or directory: /proc/x; check the name and your permissions."
    assert sentence(absent) == said
    full = OSError(errno.ENOSPC, "No space left on device", "/mnt/a")
    told = sentence(full)
    assert told is not None
    assert "/mnt/a; make room there" in told


@pytest.mark.parametrize("content", [b"", b"NRRD0004\ntype: nonsense\n", b"\x00" * 99])
def test_unreadable_volume(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan = tmp_path / "scan.nrrd"
    scan.write_bytes(content)
    words = ["snapshot", "--volume", str(scan), "--out", str(tmp_path / "a.png")]
    words += ["--eye", "0", "-200", "0", "--target", "0", "0", "0"]
    assert main(words) == 1
    assert "scan.nrrd" in told(capsys)
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("command", ["demo", "register", "train", "doctor"])
def test_no_such_port_is_told_before_anything_slow_begins(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([command, "--device", "/dev/ttyNOTHING"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    (line,) = said.err.splitlines()
    assert "serial port /dev/ttyNOTHING cannot be opened" in line
    assert not list(tmp_path.iterdir())


def test_a_folder_in_use_is_not_shared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    handle = os.open(tmp_path / ".lock", os.O_CREAT | os.O_RDWR)
    fcntl.flock(handle, fcntl.LOCK_EX)
    assert main(["demo", "--out", str(tmp_path)]) == 1
    assert "Another command is writing" in told(capsys)
    os.close(handle)


def test_a_stranger_in_the_session_folder_is_not_deleted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    precious = tmp_path / "flight.paravol" / "thesis.txt"
    precious.parent.mkdir()
    precious.write_text("years of work")
    assert main(["demo", "--out", str(tmp_path)]) == 1
    assert "thesis.txt" in told(capsys)
    assert precious.read_text() == "years of work"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tmp_path.chmod(0o500)
    assert main(["demo", "--out", str(tmp_path / "out")]) == 1
    assert "cannot be written" in told(capsys)


def test_a_file_in_the_folder_s_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").write_text("a file")
    assert main(["demo", "--out", str(tmp_path / "out" / "demo")]) == 1
    assert "cannot be written" in told(capsys)


def test_a_debrief_lies_beside_its_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Path] = []

    def write(order: DebriefOrder, *told: object) -> None:
        asked.append(order.out)
        raise KeyboardInterrupt

    monkeypatch.setattr("paravol.debrief.write_debrief", write)
    for name in ("b.paravol", "b"):
        with pytest.raises(KeyboardInterrupt):
            debrief(tmp_path / name)
    assert asked == [tmp_path / "b-debrief.html"] * 2


def test_what_is_no_session_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    assert main(["debrief", str(tmp_path), "--out", str(out)]) != 0
    assert "session.json" in capsys.readouterr().err
    assert not out.exists()


def test_an_unknown_rubric_is_refused_before_anything_is_stepped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    words = ["debrief", str(SESSION), "--out", str(out), "--rubric", "endoscpy"]
    assert main(words) != 0
    assert "did you mean 'endoscopy'?" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.slow
def test_a_flight_becomes_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    words = ["debrief", str(SESSION), "--out", str(out), "--no-pictures", "--json"]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["out"] == str(out)
    assert told["size_bytes"] == out.stat().st_size
    assert told["rubric"] == "endoscopy"
    assert told["pictures"] == 0
