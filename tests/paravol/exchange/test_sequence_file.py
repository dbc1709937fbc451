"""Sequence files: round trips, another reader's view of ours, files that mean harm."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK

from paravol.exchange import sequence_file
from paravol.exchange.sequence_file import read_sequence, write_sequence
from paravol.exchange.tool_motion import Motions, ras_from_lps
from system import ForeignFileError, UserError
from tests.paravol.exchange.made_motion import motion, motions

THEIRS = """ObjectType = Image
NDims = 3
DimSize = 2 1 3
ElementType = MET_UCHAR
UltrasoundImageOrientation = MF
Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 -20 0 0 -1 30 0 1 0 40 0 0 0 1
Seq_Frame0000_ProbeToTrackerTransformStatus = OK
Seq_Frame0000_Timestamp = 23.5
Seq_Frame0000_ImageStatus = OK
Seq_Frame0002_Timestamp = 23.7
Seq_Frame0002_ProbeToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
Seq_Frame0001_ProbeToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
Seq_Frame0001_ProbeToTrackerTransformStatus = INVALID
Seq_Frame0001_Timestamp = 23.6
ElementDataFile = LOCAL
Seq_Frame0009_Timestamp = 1e9
"""


@pytest.mark.parametrize("ending", ["seq.mha", "igs.mha", "seq.nrrd"])
def test_what_is_written_is_read_back(tmp_path: Path, ending: str) -> None:
    """To the bit, with status and times."""
    file = tmp_path / f"a.{ending}"
    written = motions()
    write_sequence(file, written)
    found = read_sequence(file)
    by_name = {tool.name: tool for tool in found.tools}
    assert len(by_name) == len(written.tools)
    for before in written.tools:
        tool = by_name[before.name]
        assert np.array_equal(tool.time_s, before.time_s)
        assert np.array_equal(tool.valid, before.valid)
        good = before.valid
        assert np.array_equal(tool.world_from_tool[good], before.world_from_tool[good])
    # Slicer reads a thousand characters at a time
    head = file.read_bytes().split(b"\0")[0]
    assert max(map(len, head.splitlines())) < 1000


def test_another_reader_finds_the_same_numbers(tmp_path: Path) -> None:
    """ITK opens the NRRD as it is, and has the poses in RAS among its keys."""
    written = motions()
    write_sequence(tmp_path / "a.seq.nrrd", written)
    reader: Any = SimpleITK.ImageFileReader()  # type: ignore[no-untyped-call]
    reader.SetFileName(str(tmp_path / "a.seq.nrrd"))
    reader.ReadImageInformation()
    tool = written.tools[0]
    frames = ras_from_lps(tool.world_from_tool)
    for i in (0, 5, 39):
        key = f"Seq_Frame{i:04d}_ScopeTipToRasTransform"
        numbers = [float(word) for word in reader.GetMetaData(key).split()]
        assert numbers == frames[i].ravel().tolist() or not tool.valid[i]
        status = reader.GetMetaData(f"{key}Status")
        assert status == ("OK" if tool.valid[i] else "INVALID")
    # to ITK a list of pictures is one of many components
    assert reader.GetNumberOfComponents() == len(tool.time_s)


def test_a_file_of_their_own_words(tmp_path: Path) -> None:
    """Frames in any order, pictures left alone, RAS to LPS."""
    (tmp_path / "a.igs.mha").write_bytes(THEIRS.encode() + bytes(6))
    (tool,) = read_sequence(tmp_path / "a.igs.mha").tools
    assert tool.name == "ProbeToTracker"
    assert tool.time_s.tolist() == [23.5, 23.6, 23.7]
    assert tool.valid.tolist() == [True, False, True]
    assert tool.world_from_tool[0, :3, 3].tolist() == [20.0, -30.0, 40.0]
    assert tool.rising.tolist() == [0, 2]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("GIF89a", "begins like no MetaImage or NRRD"),
        ("", "no transform"),
        ("ObjectType = Image\nElementDataFile = LOCAL\n", "no transform"),
        (THEIRS.replace("1 0 0 -20", "1 0 -20"), "15 numbers"),
        (THEIRS.replace("1 0 0 -20", "1 0 zero -20"), "zero"),
        (THEIRS.replace("Frame0002", "Frame9999999999"), "more than"),
    ],
)
def test_harm_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.seq.mha").write_text(text)
    with pytest.raises(ForeignFileError, match=words):
        read_sequence(tmp_path / "a.seq.mha")


def test_a_frame_without_its_time_is_invalid(tmp_path: Path) -> None:
    text = THEIRS.replace("Seq_Frame0002_Timestamp = 23.7\n", "")
    (tmp_path / "a.seq.mha").write_text(text)
    (tool,) = read_sequence(tmp_path / "a.seq.mha").tools
    assert tool.valid.tolist() == [True, False, False]


def test_a_header_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.seq.mha").write_text(THEIRS)
    monkeypatch.setattr(sequence_file, "LARGEST_FILE", 100)
    with pytest.raises(ForeignFileError, match="too large"):
        read_sequence(tmp_path / "a.seq.mha")


def test_a_sequence_has_one_row_of_times(tmp_path: Path) -> None:
    first, second = motions().tools
    late = replace(second, time_s=second.time_s + 1.0)
    with pytest.raises(UserError, match="same times"):
        write_sequence(tmp_path / "a.seq.mha", Motions((first, late)))
    with pytest.raises(UserError, match=r"\.mha or \.nrrd"):
        write_sequence(tmp_path / "a.txt", Motions((motion("a"),)))
