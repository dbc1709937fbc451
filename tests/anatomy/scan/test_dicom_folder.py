"""Folders with links, bombs and damaged headers among their files."""

import importlib
import os
import zlib
from pathlib import Path

import pytest
from pydicom import Dataset, FileMetaDataset
from pydicom.uid import DeflatedExplicitVRLittleEndian, generate_uid

from anatomy.scan import dicom_folder
from anatomy.scan.dicom_folder import examination_files, is_dicom, read_dicom
from anatomy.scan.scan import read_scan


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder with a file, a folder in it, and a file beside it."""
    inside = tmp_path / "examination"
    (inside / "b").mkdir(parents=True)
    (inside / "b" / "1").write_bytes(b"x")
    (inside / "2").write_bytes(b"y")
    (tmp_path / "secret").write_bytes(b"z")
    return inside


def test_files_are_listed_in_order(folder: Path) -> None:
    assert examination_files(folder) == [folder / "2", folder / "b" / "1"]
    # what is there already is no second image
    (folder / "3").symlink_to(folder / "2")
    (folder / "c").symlink_to("b")
    os.mkfifo(folder / "4")
    assert examination_files(folder) == [folder / "2", folder / "b" / "1"]
    # the folder itself may be a link
    (folder.parent / "link").symlink_to(folder)
    assert len(examination_files(folder.parent / "link")) == 2


@pytest.mark.parametrize(
    ("target", "complaint"),
    [
        ("../secret", "leads out of the folder"),
        ("..", "leads out of the folder"),
        ("/etc", "leads out of the folder"),
        ("absent", "nowhere or in a circle"),
        ("link", "nowhere or in a circle"),
    ],
)
def test_links_that_lead_elsewhere_are_refused(
    folder: Path, target: str, complaint: str
) -> None:
    (folder / "link").symlink_to(target)
    with pytest.raises(ValueError, match=rf"examination/link .*{complaint}"):
        read_scan(folder)


def test_a_link_to_the_folder_above_is_no_circle(folder: Path) -> None:
    (folder / "b" / "up").symlink_to("..")
    assert len(examination_files(folder)) == 2


def deflated(file: Path, name: str, after: int = 0) -> None:
    """Write a deflated file; after: zeros behind its elements, in MiB."""
    plain = Dataset()
    plain.PatientName = name
    plain.file_meta = FileMetaDataset()
    plain.file_meta.MediaStorageSOPClassUID = generate_uid()
    plain.file_meta.MediaStorageSOPInstanceUID = generate_uid()
    plain.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    plain.save_as(file, enforce_file_format=True)
    if after:
        content = file.read_bytes()
        start = 144 + int.from_bytes(content[140:144], "little")
        packer = zlib.compressobj(9, zlib.DEFLATED, -15)
        packed = packer.compress(zlib.decompress(content[start:], -15))
        for _ in range(after):
            packed += packer.compress(bytes(1 << 20))
        file.write_bytes(content[:start] + packed + packer.flush())


def test_a_deflated_file_is_read(tmp_path: Path) -> None:
    deflated(tmp_path / "a", "Nobody")
    assert is_dicom(tmp_path / "a")
    assert read_dicom(tmp_path / "a").PatientName == "Nobody"


def test_a_file_that_unpacks_to_more_than_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    resource = importlib.import_module("resource")
    monkeypatch.setattr(dicom_folder, "memory_limit", lambda: 400 << 20)
    deflated(tmp_path / "bomb", "Nobody", after=300)
    assert (tmp_path / "bomb").stat().st_size < 400_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=r"bomb unpacks to more than 104,857,600"):
        read_scan(tmp_path)
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown_kb < 50_000
