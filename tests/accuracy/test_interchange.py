"""What others read out of a case: SimpleITK its grids, a plain parser its labels."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray

from anatomy.case import Case, CaseRecord, read_case, store_case
from anatomy.files.segments import STRUCTURE, code_of
from anatomy.files.surfaces import Surface, save_surface
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Side
from renderers.scene.volume import Volume

SHAPE = (13, 17, 11)
SPACING = np.full(3, 0.7)
ORIGIN = np.array([-31.25, 12.5, -7.75])
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
NAMES = {1: "airway", 2: "cavity 1 left", 9: "cavity 2 right"}
MARKS = {
    "nostril, left": Landmark("nostril", Side.LEFT, np.array([7.1, -3.3, 1 / 3]), 5.0),
    "tip": Landmark("tip", Side.MIDLINE, np.array([-0.1, 2e-7, 1e3]), 1.0),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case that is its own mirror image along no axis, and lies turned."""
    rng = np.random.default_rng(8)

    def volume(values: NDArray[np.generic], background: float) -> Volume:
        return Volume(values, SPACING, ORIGIN, TURN, background)

    labels = rng.choice(np.array([0, 1, 2, 9], np.uint8), SHAPE)
    volumes = {
        "ct": volume(rng.integers(-1024, 3071, SHAPE).astype(np.int16), -1000.0),
        "labels": volume(labels, 0.0),
        "distance": volume(rng.normal(size=SHAPE).astype(np.float32), 6.0),
        "mr": volume(rng.integers(-1024, 500, SHAPE).astype(np.int16), -1000.0),
    }
    record = CaseRecord(schema_version=1, spacing_mm=0.7, parameters=None, sha256={})
    path = tmp_path_factory.mktemp("case")
    store_case(path, volumes, NAMES, MARKS, record)
    return path


@pytest.fixture(scope="module")
def case(folder: Path) -> Case:
    return read_case(folder)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("ct", "ct.nrrd"),
        ("labels", "labels.seg.nrrd"),
        ("distance", "distance.nrrd"),
        ("mr", "mr.nrrd"),
    ],
)
def test_simpleitk_reads_the_same_numbers_at_the_same_places(
    folder: Path, case: Case, name: str, file: str
) -> None:
    sitk = importlib.import_module("SimpleITK")
    image = sitk.ReadImage(str(folder / file))
    mine = case.volumes[name]
    values = sitk.GetArrayFromImage(image)
    assert values.dtype == mine.values.dtype
    assert values.tobytes() == mine.values.tobytes()
    for index in ((0, 0, 0), (10, 0, 0), (0, 16, 0), (0, 0, 12), (3, 5, 7)):
        place = np.array(image.TransformIndexToPhysicalPoint(index))
        expected = mine.world_from_voxel @ np.array([*index, 1])
        assert place == pytest.approx(expected[:3], abs=1e-9)
    # a step along the array's x goes to the back: the turn has not been lost
    assert np.array(image.GetDirection()).reshape(3, 3) == pytest.approx(TURN)


def test_slicers_own_reader_knows_the_segments(folder: Path) -> None:
    slicerio = importlib.import_module("slicerio")
    read = slicerio.read_segmentation(str(folder / "labels.seg.nrrd"))
    assert {s["labelValue"]: s["name"] for s in read["segments"]} == NAMES
    nz, ny, nx = SHAPE
    for segment in read["segments"]:
        assert segment["extent"] == [0, nx - 1, 0, ny - 1, 0, nz - 1]
        assert segment["status"] == "completed"
        assert segment["terminology"]["category"] == ["SCT", *STRUCTURE]
        assert segment["terminology"]["type"] == ["SCT", *code_of(segment["name"])]
    assert read["containedRepresentationNames"] == ["Binary labelmap"]
    # its arrays are indexed x, y, z, and its world is LPS as the file's
    again = read_case(folder).labels
    assert np.array_equal(read["voxels"].transpose(), again.values)
    assert read["ijkToLPS"] == pytest.approx(again.world_from_voxel, abs=1e-9)


def test_landmarks_are_read_by_a_plain_parser(folder: Path) -> None:
    markup = json.loads((folder / "landmarks.mrk.json").read_text())["markups"][0]
    assert (markup["type"], markup["coordinateSystem"]) == ("Fiducial", "LPS")
    points = {p["label"]: p["position"] for p in markup["controlPoints"]}
    # decimal text that keeps every bit
    assert points["nostril"] == [7.1, -3.3, 1 / 3]
    assert points["tip"] == [-0.1, 2e-7, 1e3]


def test_what_is_written_again_is_the_same_to_the_byte(
    folder: Path, case: Case, tmp_path: Path
) -> None:
    names = {int(v): name for v, name in case.record.label_names.items()}
    again = store_case(tmp_path, case.volumes, names, case.landmarks, case.record)
    assert again == case.record
    for file in sorted(folder.iterdir()):
        assert (tmp_path / file.name).read_bytes() == file.read_bytes(), file.name


@pytest.mark.parametrize("ending", ["ply", "vtp"])
def test_pyvista_finds_the_surface_on_the_same_side_as_simpleitk_the_voxel(
    folder: Path, case: Case, tmp_path: Path, ending: str
) -> None:
    """Volume and surface of one place, each read by somebody else's reader."""
    sitk = importlib.import_module("SimpleITK")
    image = sitk.ReadImage(str(folder / "ct.nrrd"))
    voxels = [(9, 1, 2), (1, 15, 3), (2, 3, 11)]
    corners = [case.ct.world_from_voxel @ np.array([*v, 1.0]) for v in voxels]
    surface = Surface(np.array(corners)[:, :3], np.array([[0, 1, 2]]))
    save_surface(surface, tmp_path / f"s.{ending}")
    points = np.asarray(pv.read(tmp_path / f"s.{ending}").points, np.float64)
    for voxel, point in zip(voxels, points, strict=True):
        assert image.TransformPhysicalPointToIndex(point.tolist()) == voxel
