"""From a file to a flight: a made head goes all the way, mistakes do not."""

import json
from pathlib import Path

import numpy as np
import pytest

from anatomy.case import read_case
from anatomy.files import load_volume, save_volume
from anatomy.markups import read_markups
from anatomy.surfaces import load_surface
from app.__main__ import main
from app.case_exercise import exercise_of
from app.inputs.hand import nostril_fulcrum
from app.operating_room import prepare_room
from devices import load_probe_path
from renderers.scene import Volume
from scenarios import load_scenario

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
    assert main(again) == 0
    told = json.loads(capsys.readouterr().out)
    # left is +x, and so is the sinus
    (cavity,) = told["cavities"]
    assert cavity["center_mm"] == pytest.approx([25, 0, 0], abs=0.6)
    assert cavity["volume_ml"] == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.1)
    assert told["nostrils"]["nostril, left"][0] == pytest.approx(7, abs=1)
    assert told["nostrils"]["nostril, right"][0] == pytest.approx(-7, abs=1)
    header = (case / "labels.seg.nrrd").read_bytes().split(b"\n\n")[0]
    assert b"Segment0_Name:=airway" in header
    assert b"Segment1_Name:=cavity 1" in header
    # the same scan gives the same case
    assert read_case(case).record == before.record
    assert not list(case.glob(".*"))


def test_the_case_is_a_room_with_a_way_in(case: Path) -> None:
    scenario, folder = load_scenario(str(exercise_of(case)))
    room = prepare_room(scenario, lambda stage, share: None)
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


@pytest.mark.parametrize("ending", ["ply", "vtp"])
def test_surfaces_of_the_case(
    case: Path, tmp_path: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(case), "--out", str(tmp_path), "--format", ending]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["triangles"]) == {
        f"{name}.{ending}" for name in ("air", "skin", "airway", "cavity_1")
    }
    sinus = load_surface(tmp_path / f"cavity_1.{ending}")
    assert sinus.vertices.mean(axis=0) == pytest.approx([25, 0, 0], abs=0.5)
    skin = load_surface(tmp_path / f"skin.{ending}")
    away = np.linalg.norm(skin.vertices, axis=1)
    assert np.median(away) == pytest.approx(45, abs=0.5)
    # its triangles face the room
    corners = skin.vertices[skin.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sum(normals * corners.mean(axis=1), axis=1) > 0).mean() > 0.9


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
        (["head.nrrd", "--out", "full"], "holds something that is no case"),
        (["head.nrrd", "--out", "noise.nrrd"], "is a file"),
        (["head.nrrd", "--second", "head.nrrd"], "an MR laid onto a CT"),
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
