"""Labels of a scan from other programs."""

import json
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from hypothesis import given
from hypothesis import strategies as st

from anatomy.files.segments import segment_fields
from anatomy.files.volumes import save_volume
from anatomy.scan.label_file import check_labels, hazards_from_labels, read_labels
from anatomy.scan.label_names import HAZARDS, TASKS, hazard_of
from renderers.scene import Volume
from system import UserError
from tests.anatomy.volume_files import write_volume

ORIGIN = np.array([-20.0, 5.0, 30.0])
AWAY = np.array([0.0, 300.0, 0.0])
SHAPE = (30, 40, 36)


def scan() -> Volume:
    """Return a head of soft tissue with a block of air."""
    values = np.full(SHAPE, 40, np.int16)
    values[10:20, 10:20, :8] = -1000
    return Volume(values, np.ones(3), ORIGIN)


def balls(*marked: tuple[int, tuple[int, int, int], float]) -> Volume:
    """Mark balls: value, middle in voxels z y x, radius in voxels."""
    values = np.zeros(SHAPE, np.uint8)
    grid = np.indices(SHAPE)
    for value, middle, radius in marked:
        off = grid - np.array(middle)[:, None, None, None]
        values[np.sqrt((off**2).sum(axis=0)) <= radius] = value
    return Volume(values, np.ones(3), ORIGIN, background=0.0)


TWO = ((3, (15, 20, 25), 6.0), (7, (8, 30, 10), 4.0))


def slicer(folder: Path, names: dict[int, str], labels: Volume) -> Path:
    path = folder / "head.seg.nrrd"
    save_volume(labels, path, segment_fields(names, labels.shape))
    return path


@given(st.sampled_from([n for t in TASKS.values() for n in t]))
def test_every_name_of_the_tasks_is_known(name: str) -> None:
    assert hazard_of(name) is not None


@pytest.mark.parametrize(
    ("name", "hazard"),
    [
        ("optic_nerve_left", "optic nerve"),
        ("internal_carotid_artery_right", "internal carotid"),
        ("R-ON", "optic nerve"),
        ("L-MS", ""),
        ("NS", "septum"),
        ("Left Orbit", "orbit"),
        ("OpticNerve_R", "optic nerve"),
        ("brain", "brain"),
        ("nasal_cavity_left", ""),
        ("spleen", None),
        ("Optic nerves", "optic nerve"),
        ("eye_left_1", "eye"),
        ("CN II", "optic nerve"),
        ("CN II left", "optic nerve"),
        ("cranial nerve V2", "maxillary nerve"),
        ("internal carotid arteries", None),
        ("Internal Carotids", "internal carotid"),
        ("left_maxillary_sinus", ""),
        ("superior_rectus_muscle_right", ""),
        ("upper_right_first_molar", ""),
        ("vertebrae_C1", None),
    ],
)
def test_names_of_other_programs(name: str, hazard: str | None) -> None:
    assert hazard_of(name) == hazard


def test_no_name_stands_for_two_hazards() -> None:
    names = [name for held in HAZARDS.values() for name in held]
    assert len(names) == len(set(names))
    for hazard, held in HAZARDS.items():
        assert {hazard_of(name) for name in held} == {hazard}


def test_a_segmentation_of_slicer_becomes_distances(tmp_path: Path) -> None:
    labels = read_labels(
        slicer(tmp_path, {3: "Orbit right", 7: "optic nerve"}, balls(*TWO))
    )
    check_labels(labels, scan())
    fine = Volume(np.zeros((50, 66, 60), np.int16), np.full(3, 0.5), ORIGIN + 2.0)
    hazards = hazards_from_labels(labels, fine)
    assert set(hazards.names) == {"orbit", "optic nerve"}
    assert hazards.source == "head.seg.nrrd"
    places = fine.origin_mm + np.random.default_rng(0).uniform(1, 22, (500, 3))
    for name, (_, middle, radius) in zip(("orbit", "optic nerve"), TWO, strict=True):
        center = ORIGIN + np.array(middle[::-1])
        true = np.linalg.norm(places - center, axis=1) - radius
        true = np.minimum(true, 25.0)
        error = hazards.distance_mm(name, places) - true
        # a ball of voxels is a staircase of one millimetre
        assert np.abs(error).max() < 1.0
        assert abs(np.median(error)) < 0.5


def test_a_nifti_carries_its_names_in_xml(tmp_path: Path) -> None:
    """As TotalSegmentator writes them with its option for one file."""
    path = tmp_path / "labels.nii"
    save_volume(balls(*TWO), path)
    raw = bytearray(path.read_bytes())
    xml = (
        b"<CaretExtension><VolumeInformation><LabelTable>"
        b'<Label Key="3" Red="1"><![CDATA[eye_left]]></Label>'
        b'<Label Key="7" Red="1"><![CDATA[optic_nerve_left]]></Label>'
        b"</LabelTable></VolumeInformation></CaretExtension>"
    )
    size = (len(xml) + 8 + 15) // 16 * 16
    extension = b"\x01\0\0\0" + size.to_bytes(4, "little") + (30).to_bytes(4, "little")
    extension += xml.ljust(size - 8, b"\0")
    raw[108:112] = np.float32(352 + size).tobytes()
    path.write_bytes(bytes(raw[:348]) + extension + bytes(raw[352:]))
    labels = read_labels(path)
    assert labels.names == {3: ("eye_left",), 7: ("optic_nerve_left",)}
    assert labels.hazards() == {"eye": [3], "optic nerve": [7]}


def test_names_may_be_given(tmp_path: Path) -> None:
    path = tmp_path / "labels.nii.gz"
    save_volume(balls((5, (15, 20, 25), 5.0)), path)
    with pytest.raises(UserError, match="--label-names"):
        read_labels(path)
    task = read_labels(path, "head_glands_cavities")
    assert task.hazards() == {"optic nerve": [5]}
    for content in ({"5": "orbit"}, {"labels": {"background": 0, "orbit": 5}}):
        (tmp_path / "dataset.json").write_text(json.dumps(content))
        found = read_labels(path, str(tmp_path / "dataset.json"))
        assert found.hazards() == {"orbit": [5]}
    (tmp_path / "dataset.json").write_text("[1]")
    with pytest.raises(UserError, match="names no labels"):
        read_labels(path, str(tmp_path / "dataset.json"))
    with pytest.raises(UserError, match="neither a known task"):
        read_labels(path, "head_gland")


def test_unknown_names_are_told_by_name(tmp_path: Path) -> None:
    labels = read_labels(slicer(tmp_path, {3: "orbit", 7: "lesion"}, balls(*TWO)))
    (note,) = labels.notes()
    assert "lesion" in note
    assert "rename" in note
    only = read_labels(slicer(tmp_path, {3: "lesion", 7: "mandible"}, balls(*TWO)))
    with pytest.raises(UserError, match=r"lesion, mandible.*orbit"):
        check_labels(only, scan())


def test_labels_of_another_scan_are_refused(tmp_path: Path) -> None:
    names = {3: "orbit"}
    here = balls((3, (15, 20, 25), 6.0))
    away = Volume(here.values, np.ones(3), ORIGIN + AWAY, background=0.0)
    with pytest.raises(UserError, match="frame"):
        check_labels(read_labels(slicer(tmp_path, names, away)), scan())
    flipped = Volume(
        here.values, np.ones(3), ORIGIN, np.diag([-1.0, -1.0, 1.0]), background=0.0
    )
    with pytest.raises(UserError, match="flipped"):
        check_labels(read_labels(slicer(tmp_path, names, flipped)), scan())
    smaller = Volume(here.values[:-4], np.ones(3), ORIGIN + AWAY, background=0.0)
    with pytest.raises(UserError, match="does not overlap"):
        check_labels(read_labels(slicer(tmp_path, names, smaller)), scan())
    in_air = balls((3, (15, 15, 3), 3.0))
    with pytest.raises(UserError, match="lie in air"):
        check_labels(read_labels(slicer(tmp_path, names, in_air)), scan())


def test_a_scan_is_no_label_map(tmp_path: Path) -> None:
    values = np.linspace(0.0, 1.0, int(np.prod(SHAPE)), dtype=np.float32)
    path = tmp_path / "soft.nrrd"
    save_volume(Volume(values.reshape(SHAPE), np.ones(3), ORIGIN), path)
    with pytest.raises(UserError, match="no label map"):
        read_labels(path, "head_glands_cavities")


def test_segments_that_overlap_are_hazards_each(tmp_path: Path) -> None:
    """As 3D Slicer writes them: layers of a fourth axis, which comes first."""
    near = ((1, (15, 20, 25), 6.0), (1, (15, 20, 20), 4.0), (2, (8, 30, 10), 4.0))
    layers = [balls(near[0], near[2]).values, balls(near[1]).values]
    path = tmp_path / "head.seg.nrrd"
    write_volume(
        path,
        np.stack(layers, axis=-1).tobytes(),
        type="unsigned char",
        dimension="4",
        sizes=f"2 {SHAPE[2]} {SHAPE[1]} {SHAPE[0]}",
        space_directions="none (1,0,0) (0,1,0) (0,0,1)",
        kinds="list domain domain domain",
        space_origin=f"({ORIGIN[0]},{ORIGIN[1]},{ORIGIN[2]})",
        more="".join(
            f"Segment{n}_Name:={name}\nSegment{n}_LabelValue:={value}\n"
            f"Segment{n}_Layer:={layer}\n"
            for n, (name, value, layer) in enumerate(
                (("Orbit", 1, 0), ("Tumour", 2, 0), ("Optic nerve", 1, 1))
            )
        ),
    )
    labels = read_labels(path)
    check_labels(labels, scan())
    held = labels.hazards()
    for name, (_, middle, radius) in zip(("orbit", "optic nerve"), near, strict=False):
        alone = balls((1, middle, radius)).values
        assert np.array_equal(np.isin(labels.volume.values, held[name]), alone > 0)
    assert any("Tumour" in note for note in labels.notes())


def test_layers_without_names_and_a_fourth_axis_of_space_are_refused(
    tmp_path: Path,
) -> None:
    image = sitk.GetImageFromArray(np.zeros((2, 8, 8, 8), np.uint8), isVector=False)
    sitk.WriteImage(image, str(tmp_path / "time.seg.nrrd"))
    with pytest.raises(UserError, match="3-D"):
        read_labels(tmp_path / "time.seg.nrrd")
    two = sitk.GetImageFromArray(np.zeros((8, 8, 8, 2), np.uint8), isVector=True)
    sitk.WriteImage(two, str(tmp_path / "layers.seg.nrrd"))
    with pytest.raises(UserError, match="2 layers"):
        read_labels(tmp_path / "layers.seg.nrrd")


def mask(
    folder: Path, name: str, *balls_: tuple[int, tuple[int, int, int], float]
) -> None:
    save_volume(balls(*balls_), folder / f"{name}.nii.gz")


def test_a_folder_of_masks_is_a_label_map(tmp_path: Path) -> None:
    """As TotalSegmentator writes them unless it is asked for one file."""
    mask(tmp_path, "eye_left", (1, (15, 20, 25), 6.0))
    mask(tmp_path, "optic_nerve_left", (1, (15, 20, 20), 4.0))
    mask(tmp_path, "optic_nerve_right", (1, (8, 30, 10), 3.0))
    mask(tmp_path, "liver", (1, (8, 10, 10), 3.0))
    mask(tmp_path, "skull", (1, (20, 30, 30), 3.0))
    (tmp_path / "statistics.json").write_text("{}")
    (tmp_path / ".DS_Store").write_bytes(b"x")
    labels = read_labels(tmp_path)
    found = hazards_from_labels(labels, scan()).volumes
    assert found.keys() == {"eye", "optic nerve"}
    for name, inside, outside in (
        ("eye", (15, 20, 25), (8, 30, 10)),
        ("optic nerve", (15, 20, 20), (15, 20, 30)),
        ("optic nerve", (8, 30, 10), (20, 10, 10)),
    ):
        assert found[name].values[inside] < 0 < found[name].values[outside]
    # both of them are where they overlap
    assert found["eye"].values[15, 20, 21] < 0
    assert found["optic nerve"].values[15, 20, 21] < 0
    (note,) = labels.notes()
    assert "left out: liver;" in note


def test_masks_on_different_grids_are_refused(tmp_path: Path) -> None:
    mask(tmp_path, "eye_left", (1, (15, 20, 25), 6.0))
    other = balls((1, (15, 20, 25), 6.0))
    moved = Volume(other.values, np.full(3, 1.1), ORIGIN, background=0.0)
    save_volume(moved, tmp_path / "eye_right.nii.gz")
    with pytest.raises(UserError, match=r"eye_right\.nii\.gz lies on another grid"):
        read_labels(tmp_path)


def test_a_folder_without_hazards_says_what_is_known(tmp_path: Path) -> None:
    mask(tmp_path, "liver", (1, (15, 20, 25), 6.0))
    with pytest.raises(UserError, match=r"holds no mask .*optic nerve"):
        read_labels(tmp_path)


def test_regions_of_nnunet_share_their_values(tmp_path: Path) -> None:
    save_volume(balls(*TWO), tmp_path / "a.nrrd")
    names = {"labels": {"background": 0, "orbit": [3, 7], "eye": [7], "brain": 9}}
    (tmp_path / "dataset.json").write_text(json.dumps(names))
    labels = read_labels(tmp_path / "a.nrrd", str(tmp_path / "dataset.json"))
    assert labels.hazards() == {"orbit": [3, 7], "eye": [7]}
