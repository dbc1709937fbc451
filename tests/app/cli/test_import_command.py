"""From a file to a flight: a made head goes all the way, mistakes do not."""

import dataclasses
import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from PIL import Image

from anatomy.case import read_case
from anatomy.files.markups import read_markups, write_markups
from anatomy.files.segments import segment_fields
from anatomy.files.surfaces import load_surface, save_surface
from anatomy.files.volumes import load_volume, save_volume
from anatomy.tissue import Label
from app.__main__ import main
from devices import load_probe_path
from paravol.exercises.case_scenario import scenario_of_case
from paravol.inputs.hand import nostril_fulcrum
from paravol.patient import load_case, load_patient
from renderers.scene import Volume
from scenarios import load_scenario
from tests.dicom_files import write_slice

STEP = 1.5


def made_head() -> Volume:
    """A ball of tissue with two nostrils, a cave, and a sinus on its left side."""
    axis = np.arange(-60.0, 61.0, STEP)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    air = -(np.sqrt(x**2 + y**2 + z**2) - 45)
    air = np.minimum(air, np.sqrt(x**2 + (y / 2) ** 2 + z**2) - 9)
    for side in (-7, 7):
        air = np.minimum(air, np.maximum(np.hypot(x - side, z) - 4.5, y))
    air = np.minimum(air, np.sqrt((x - 25) ** 2 + y**2 + z**2) - 8)
    hu = np.clip(-480 + 520 * air / (STEP / 2), -1000, 40)
    # bone behind, for a histogram like a head's
    hu[(y > 20) & (np.sqrt(x**2 + y**2 + z**2) < 40) & (hu > 0)] = 700
    return Volume(np.rint(hu).astype(np.int16), np.full(3, STEP), np.full(3, -60.0))


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("scan") / "head.nrrd"
    save_volume(made_head(), file)
    return file


@pytest.fixture(scope="module")
def case(scan: Path) -> Path:
    folder = scan.parent / "case"
    words = ["import", str(scan), "--out", str(folder), "--spacing", "1.0", "--json"]
    assert main(words) == 0
    return folder


def test_a_made_head_becomes_a_case(
    case: Path, scan: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = ["import", str(scan), "--out", str(case), "--spacing", "1.0", "--json"]
    before = read_case(case)
    exercise = (case / "exercise.toml").read_text() + "# mine\n"
    (case / "exercise.toml").write_text(exercise)
    assert main(again) == 1
    assert (
        "holds the case of head.nrrd with its exercise.toml" in capsys.readouterr().err
    )
    assert (case / "exercise.toml").read_text() == exercise
    assert main([*again, "--force"]) == 0
    assert (case / "exercise.toml").read_text() + "# mine\n" == exercise
    told = json.loads(capsys.readouterr().out)
    # left is +x, and so is the sinus
    # the cave is in the middle: a passage, as a nose is
    (cavity,) = told["cavities"]
    assert cavity["center_mm"] == pytest.approx([25, 0, 0], abs=0.6)
    assert cavity["volume_ml"] == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.1)
    assert told["nostrils"]["nostril, left"][0] == pytest.approx(7, abs=1)
    assert told["nostrils"]["nostril, right"][0] == pytest.approx(-7, abs=1)
    header = (case / "labels.seg.nrrd").read_bytes().split(b"\n\n")[0]
    assert b"Segment0_Name:=nasal air" in header
    assert b"Segment1_Name:=unnamed air" in header
    # a ball has no septum and no floor: nothing is guessed
    assert (cavity["name"], cavity["confidence"]) == ("", "")
    assert (
        "no sinus is named"
        in {f["name"]: f for f in told["quality"]}["nasal floor"]["limits"]
    )
    assert (cavity["side"], cavity["is_open"]) == ("left", False)
    # it leaks into the room nowhere but at the nostrils
    openings = sorted(told["openings"], key=lambda o: o["center_mm"][0])
    assert [o["center_mm"][0] for o in openings] == pytest.approx([-7, 7], abs=1)
    assert told["transfer"]["nodes"] == sorted(told["transfer"]["nodes"])
    # the same scan gives the same case
    assert read_case(case).record == before.record
    assert not list(case.glob(".*"))


def test_the_case_is_a_room_with_a_way_in(case: Path) -> None:
    scenario, folder = load_scenario(str(scenario_of_case(case)))
    room = load_patient(scenario, lambda stage, share: None)
    path = load_probe_path(folder / scenario.path)
    fulcrum = nostril_fulcrum(room, path)
    assert abs(float(fulcrum.pivot_mm[0])) == pytest.approx(7, abs=1)
    assert fulcrum.axis[1] > 0.5
    # the path begins in front of the head and reaches the middle of the way
    assert path.tip_mm[0, 1] < fulcrum.pivot_mm[1]
    depth = (path.tip_mm - fulcrum.pivot_mm) @ fulcrum.axis
    assert depth.max() > 15
    assert room.positions(scenario.targets)
    for name, place in scenario.fiducial_positions().items():
        assert name.startswith("face")
        assert np.linalg.norm(place) == pytest.approx(45, abs=1.5)


def test_a_pivot_of_ones_own(case: Path, scan: Path, tmp_path: Path) -> None:
    words = ["import", str(scan), "--out", str(tmp_path / "case"), "--spacing", "1.5"]
    assert main([*words, "--pivot", "7", "-30", "0", "--json"]) == 0
    record = read_case(tmp_path / "case").record
    assert record.approach is not None
    assert list(record.approach.pivot_mm) == [7.0, -30.0, 0.0]
    assert main([*words, "--pivot", "700", "0", "0"]) == 1


def test_a_picture_of_the_slices_says_what_is_there(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "s.png"
    words = ["slices", str(case), "--out", str(out), "--at"]
    assert main([*words, "25", "0", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["label"] == "unnamed air"
    assert told["values"]["ct"] < -900
    assert told["values"]["distance"] < -6
    record = read_case(case).record
    assert record.transfer is not None
    assert told["nodes"] == list(record.transfer.nodes)
    sheet = np.asarray(Image.open(out))
    assert sheet.shape[0] > 900
    assert sheet.std() > 20
    assert main([*words, "0", "0", "500"]) == 1
    assert "lies outside the case" in capsys.readouterr().err
    assert main([*words, "0", "0", "0", "--show", "mr"]) == 1
    assert "the case has no second scan" in capsys.readouterr().err


def test_a_case_without_a_way_in_says_how_to_give_one(
    case: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "case"
    shutil.copytree(case, folder)
    (folder / "exercise.toml").unlink()
    record = msgspec.structs.replace(read_case(case).record, approach=None)
    (folder / "case.json").write_bytes(msgspec.json.encode(record))
    with pytest.raises(ValueError, match=r"import the scan again with --pivot x y z"):
        scenario_of_case(folder)


@pytest.mark.slow
def test_a_snapshot_of_a_case_sees_its_sinus(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the sinus' middle, all around is wall; from its exercise, there is depth."""
    out = tmp_path / "s.png"
    words = ["snapshot", "--case", str(case), "--size", "64", "--out", str(out)]
    eye = ["--eye", "25", "0", "0", "--target", "25", "10", "0"]
    assert main([*words, *eye]) == 0
    wall = np.asarray(Image.open(out)).astype(float)
    assert wall[32, 32, 0] > 1.1 * wall[32, 32, 1]
    assert main([*words, "--time", "3"]) == 0
    inside = np.asarray(Image.open(out)).astype(float)
    assert np.abs(inside - wall).mean() > 5
    away = ["--eye", "0", "-220", "0", "--target", "0", "0", "0", "--classic"]
    assert main([*words, *away]) == 0
    ball = np.asarray(Image.open(out)).astype(float)
    # the head stands in front of nothing
    assert ball[32, 32].max() > 20
    assert ball[1, 1].max() == 0
    capsys.readouterr()


@pytest.mark.parametrize("ending", ["ply", "vtp"])
def test_surfaces_of_the_case(
    case: Path, tmp_path: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(case), "--out", str(tmp_path), "--format", ending]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["triangles"]) == {
        f"{name}.{ending}" for name in ("air", "skin", "nasal_air", "unnamed_air")
    }
    sinus = load_surface(tmp_path / f"unnamed_air.{ending}")
    assert sinus.vertices.mean(axis=0) == pytest.approx([25, 0, 0], abs=0.5)
    skin = load_surface(tmp_path / f"skin.{ending}")
    away = np.linalg.norm(skin.vertices, axis=1)
    assert np.median(away) == pytest.approx(45, abs=0.5)
    # its triangles face the room
    corners = skin.vertices[skin.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sum(normals * corners.mean(axis=1), axis=1) > 0).mean() > 0.9


@pytest.mark.parametrize("ending", ["ply", "stl"])
def test_closed_surfaces_look_outwards_and_hold_their_label(
    case: Path, tmp_path: Path, ending: str
) -> None:
    """As another program reads them: by the volume they enclose."""
    assert main(["export", str(case), "--out", str(tmp_path), "--format", ending]) == 0
    labels = load_volume(case / "labels.seg.nrrd", 0.0)
    voxel_mm3 = float(labels.spacing_mm.prod())
    for name, value in (
        ("nasal_air", Label.NASAL_AIR),
        ("unnamed_air", Label.UNNAMED_AIR),
    ):
        mesh = trimesh.load_mesh(tmp_path / f"{name}.{ending}")
        own = labels.values == value
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(own.sum() * voxel_mm3, rel=0.03)


def test_a_case_goes_out_as_dicom_and_comes_in_again(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "dicom"
    words = ["export", str(case), "--out", str(out), "--format", "dicom", "--json"]
    assert main(words) == 0
    scan = load_volume(case / "ct.nrrd", -1000.0)
    told = json.loads(capsys.readouterr().out)
    assert len(told["bytes"]) == scan.shape[0] + 1
    # slices and segmentation lie side by side, as archives send them
    again = tmp_path / "again"
    words = ["import", str(out), "--out", str(again), "--spacing", "1.0"]
    # its labels lie where it does, though they name nothing to be kept clear of
    assert main([*words, "--labels", str(out / "segmentation.dcm")]) == 1
    assert "hazards are known by names" in " ".join(capsys.readouterr().err.split())
    assert main(words) == 0
    assert "1 Segmentation Storage" in " ".join(capsys.readouterr().out.split())
    read = load_volume(again / "ct.nrrd", -1000.0)
    places = np.random.default_rng(3).uniform(-40.0, 40.0, (200, 3))
    assert read.sample(places) == pytest.approx(scan.sample(places), abs=1.0)


def test_a_scanned_face_comes_back_to_its_place(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["export", str(case), "--out", str(tmp_path)])
    skin = load_surface(tmp_path / "skin.ply")
    scanner_from_patient = np.array(
        [[0.0, -1, 0, 300], [0.6, 0, -0.8, 20], [0.8, 0, 0.6, -150], [0, 0, 0, 1]]
    )
    save_surface(skin.moved(scanner_from_patient), tmp_path / "scan.ply")
    marks = {
        name: dataclasses.replace(
            mark,
            position_mm=scanner_from_patient[:3, :3] @ mark.position_mm
            + scanner_from_patient[:3, 3],
        )
        for name, mark in read_markups(case / "landmarks.mrk.json").items()
        if name.startswith("face ")
    }
    write_markups(marks, tmp_path / "face.mrk.json")
    words = ["face", str(tmp_path / "scan.ply"), "--case", str(case)]
    words += ["--landmarks", str(tmp_path / "face.mrk.json"), "--json"]
    capsys.readouterr()
    assert main([*words, "--out", str(tmp_path / "lain.ply")]) == 0
    told = json.loads(capsys.readouterr().out)
    back = np.array(told["patient_from_face"]) @ scanner_from_patient
    assert back == pytest.approx(np.eye(4), abs=0.05)
    lain = load_surface(tmp_path / "lain.ply")
    assert lain.vertices == pytest.approx(skin.vertices, abs=0.05)
    assert (tmp_path / "lain.tfm").exists()
    assert main([*words, "--out", str(tmp_path / "lain.obj")]) == 1
    assert "must name a .ply or .vtp" in capsys.readouterr().err
    assert main(["export", str(case), "--out", str(tmp_path / "lain.ply")]) == 1
    assert "choose another with --out" in capsys.readouterr().err


def test_3d_programs_read_it_as_it_lies(case: Path) -> None:
    ct = load_volume(case / "ct.nrrd")
    assert ct.sample(np.array([25.0, 0, 0])) < -900
    assert ct.sample(np.array([-25.0, 0, 0])) > 0
    marks = read_markups(case / "landmarks.mrk.json")
    assert (
        marks["nostril, left"].position_mm[0]
        > 0
        > marks["nostril, right"].position_mm[0]
    )


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["absent.nrrd"], "no file or folder absent.nrrd"),
        (["letters"], "30 files, none of which is a DICOM image"),
        (["bomb.zip"], "bomb.zip is an archive"),
        (["petabyte.nrrd"], "needs 2,000,000,000,000,000 bytes"),
        (["noise.nrrd"], "noise.nrrd cannot be read"),
        (["head.nrrd", "--spacing", "0.01"], "0.2 to 3 mm"),
        (["head.nrrd", "--out", "full"], "no case.json: it is no case"),
        (["head.nrrd", "--out", "noise.nrrd"], "is a file"),
        (["head.nrrd", "--second", "head.nrrd"], "an MR laid onto a CT"),
        (["head.nrrd", "--series", "2"], "leave --series out"),
    ],
)
def test_mistakes_are_one_sentence_and_leave_nothing(
    scan: Path,
    words: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("head.nrrd").symlink_to(scan)
    for folder in ("letters", "full"):
        Path(folder).mkdir()
        for n in range(30):
            Path(folder, f"{n}.txt").write_text("dear reader")
    Path("bomb.zip").write_bytes(b"PK\x03\x04")
    Path("noise.nrrd").write_bytes(b"NRRD0004\nnot a header")
    Path("petabyte.nrrd").write_bytes(
        b"NRRD0005\ntype: short\ndimension: 3\nspace: left-posterior-superior\n"
        b"sizes: 1000000 1000000 1000\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
        b"space origin: (0,0,0)\nendian: little\nencoding: raw\n\n"
    )
    before = sorted(p.name for p in tmp_path.iterdir())
    line = ["import", *words]
    if "--out" not in words:
        line += ["--out", "case"]
    if "--spacing" not in words:
        line += ["--spacing", "2.0"]
    assert main(line) == 1
    told = [
        text
        for text in capsys.readouterr().err.strip().splitlines()
        if not text.endswith("...")
    ]
    assert len(told) == 1
    assert complaint in told[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_labels_come_with_a_scan_or_are_said_to_be_missing(
    case: Path, scan: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bare = load_case(case)
    assert bare.hazards is None
    assert bare.layers is not None
    assert bare.layers.uncertainty_mm > 0.0
    head = made_head()
    marks = np.zeros(head.shape, np.uint8)
    axis = np.arange(-60.0, 61.0, STEP)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    marks[np.sqrt((x - 36) ** 2 + y**2 + z**2) < 2.5] = 2
    marks[(z > 25) & (x**2 + y**2 < 100) & (z < 32)] = 9
    names = {2: "optic_nerve_left", 9: "some lesion"}
    file = scan.parent / "marks.seg.nrrd"
    marked = Volume(marks, head.spacing_mm, head.origin_mm, background=0.0)
    save_volume(marked, file, segment_fields(names, marks.shape))
    out = scan.parent / "labelled"
    words = ["import", str(scan), "--out", str(out), "--spacing", "1.0"]
    assert main([*words, "--labels", str(file)]) == 0
    told = capsys.readouterr().out
    assert "optic nerve (from marks.seg.nrrd)" in " ".join(told.split())
    assert any("some lesion" in note for note in read_case(out).record.notes)
    patient = load_case(out)
    assert patient.hazards is not None
    assert patient.hazards.names == ("optic nerve",)
    # the sinus of 8 mm round x 25, the nerve of 2.5 mm round x 36
    gap = patient.hazards.distance_mm("optic nerve", np.array([25.0, 0.0, 0.0]))
    assert float(gap) == pytest.approx(8.5, abs=1.0)
    assert main([*words, "--label-names", "total", "--force"]) == 1
    assert "give the map with --labels" in capsys.readouterr().err
    away = Volume(marks, head.spacing_mm, head.origin_mm + 400.0, background=0.0)
    save_volume(away, file, segment_fields(names, marks.shape))
    assert main([*words, "--labels", str(file), "--force"]) == 1
    assert "frame is another one" in " ".join(capsys.readouterr().err.split())
    assert load_case(out).hazards is not None


@pytest.mark.parametrize("refused", range(0, 7, 2))
def test_a_disk_that_fills_leaves_no_half_case(
    case: Path,
    tmp_path: Path,
    refused: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Neither in a new folder, nor of one that is written over."""
    scan, old, new = tmp_path / "scan.nrrd", tmp_path / "old", tmp_path / "new"
    save_volume(made_head(), scan)
    shutil.copytree(case, old)
    (old / "exercise.toml").write_text("mine")
    before = {f.name: f.read_bytes() for f in old.iterdir()}
    left = [refused]

    def save(*words: Any) -> None:
        if not left[0]:
            raise OSError(28, "No space left on device")
        left[0] -= 1
        save_volume(*words)

    monkeypatch.setattr("anatomy.case.save_volume", save)
    for out, words in ((new, ()), (old, ("--force",))):
        left[0] = refused
        assert main(["import", str(scan), "--out", str(out), *words]) == 1
        assert "No space left on device" in capsys.readouterr().err
    assert not new.exists()
    assert {f.name: f.read_bytes() for f in old.iterdir()} == before
    monkeypatch.undo()
    assert main(["import", str(scan), "--out", str(new)]) == 0
    assert read_case(new).record.sha256.keys() == read_case(case).record.sha256.keys()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
def test_names_of_any_bytes_end_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Archives of Windows and disks of old cameras bring them."""
    odd = tmp_path / os.fsdecode(b"scan \xff\xfe")
    (tmp_path / "dicom").mkdir()
    save_volume(made_head(), tmp_path / "a.nrrd")
    shutil.copy(tmp_path / "a.nrrd", f"{odd}.nrrd")
    assert main(["import", f"{odd}.nrrd", "--out", str(tmp_path / "one")]) == 1
    assert "is not UTF-8; rename it" in capsys.readouterr().err
    assert main(["import", str(tmp_path / "a.nrrd"), "--out", str(odd)]) == 1
    assert "is not UTF-8; rename it" in capsys.readouterr().err
    assert not odd.exists()
    assert not (tmp_path / "one").exists()
    # DICOM is read by name, whatever it is, and told by what can be written
    for n in range(6):
        pixels = np.full((20, 20), 1064 * (n % 2), np.int16)
        write_slice(tmp_path / "dicom" / f"{n}", pixels, np.array([0, 0, float(n)]))
    (tmp_path / "dicom").rename(odd)
    assert main(["import", str(odd), "--out", str(tmp_path / "two")]) == 1
    assert "terminate" not in capsys.readouterr().err
