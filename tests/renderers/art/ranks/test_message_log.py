from pathlib import Path

from renderers.art.ranks.message_log import FlightRecorder
from renderers.art.ranks.messages import Message, MessageKind


def test_the_last_messages_are_written_down(tmp_path: Path) -> None:
    recorder = FlightRecorder(tmp_path, 3, length=2)
    for cell in range(3):
        recorder.note("to", Message(MessageKind.REQUEST, 3, 1, 7, cell))
    recorder.note("from", Message(MessageKind.DATA, 1, 3, 7, 2, b"x" * 100))
    said = recorder.write("nobody answers")
    path = tmp_path / "flight-rank-3.txt"
    assert said == f"What it heard last is in {path}."
    first, *lines = path.read_text().splitlines()
    assert first == "rank 3: nobody answers"
    words = [line.split() for line in lines]
    assert [(w[2], w[3], w[4], w[6]) for w in words] == [
        ("to", "1", "REQUEST", "2"),
        ("from", "1", "DATA", "2"),
    ]
    assert all(float(w[0]) <= 0 for w in words)


def test_a_folder_that_cannot_be_written_is_named_no_obstacle(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    recorder = FlightRecorder(tmp_path / "file", 0)
    assert "could not be written: " in recorder.write("x")
