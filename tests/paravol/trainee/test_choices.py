"""What is remembered comes back; what is damaged is told and forgotten."""

from pathlib import Path

import pytest

from paravol.trainee.choices import ChoiceFile, Choices

CHOICES = Choices("ann", "mouse", "hoops", ("/a", "/b"), ("home",), ("x.paravol",))


def test_choices_come_back(tmp_path: Path) -> None:
    file = ChoiceFile(tmp_path / "deeper" / "trainee.json")
    assert file.load() == Choices()
    file.save(CHOICES)
    again = ChoiceFile(file.file)
    assert again.load() == CHOICES
    assert (file.told, again.told) == ("", "")
    assert [p.name for p in file.file.parent.iterdir()] == ["trainee.json"]


@pytest.mark.parametrize(
    "content", [b"", b"{", b"\xff\xfe", b"[1]", b'{"trainee": 7}', b'{"cases": "x"}']
)
def test_a_damaged_file_is_told_and_forgotten(tmp_path: Path, content: bytes) -> None:
    file = ChoiceFile(tmp_path / "trainee.json")
    file.file.write_bytes(content)
    assert file.load() == Choices()
    assert "trainee.json" in file.told
    file.save(CHOICES)
    assert ChoiceFile(file.file).load() == CHOICES


def test_what_a_later_version_keeps_is_no_damage(tmp_path: Path) -> None:
    file = ChoiceFile(tmp_path / "trainee.json")
    file.file.write_bytes(b'{"trainee": "ann", "colour": "green"}')
    assert file.load() == Choices("ann")
    assert file.told == ""


def test_a_disk_that_refuses_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    file = ChoiceFile(tmp_path / "file" / "trainee.json")
    assert file.load() == Choices()
    file.save(CHOICES)
    assert "cannot be remembered" in file.told
