"""Labels as DICOM, out and in: the same voxels, by other programs' readers and ours."""

from datetime import datetime
from pathlib import Path

import highdicom
import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.sr.codedict import codes

from anatomy.files.dicom_export import SEGMENTS, write_dicom
from anatomy.files.segments import CODES, STRUCTURE
from anatomy.scan.dicom import choose_series, find_series, read_series
from anatomy.scan.label_file import check_labels, read_labels
from renderers.scene.volume import Volume
from system import UserError

SHAPE = (7, 9, 11)
TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The array's x runs backwards, its y up, its z to the left."""

NAMES = {1: "nasal air", 4: "optic nerve", 9: "orbit", 12: "Septum"}
MADE = datetime(2026, 1, 2, 3, 4, 5)


def grid(values: NDArray[np.generic], background: float) -> Volume:
    spacing, origin = np.array([0.7, 0.5, 1.25]), np.array([-31.0, 12.5, 7.25])
    return Volume(values, spacing, origin, TURN, background)


@pytest.fixture
def written(tmp_path: Path) -> tuple[Path, Volume, Volume]:
    rng = np.random.default_rng(4)
    scan = grid(rng.integers(-1024, 3071, SHAPE).astype(np.int16), -1000.0)
    labels = grid(rng.choice(np.array([0, 1, 4, 9, 77], np.uint8), SHAPE), 0.0)
    shares = [
        share
        for share, _ in write_dicom(
            *(tmp_path, scan, labels, NAMES, "A case"),
            is_mr=False, version="1", made=MADE,
        )
    ]  # fmt: skip
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return tmp_path, scan, labels


def places(volume: Volume, inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return where voxels lie, sorted: files may hold slices in either order."""
    k, j, i = np.nonzero(inside)
    matrix = volume.world_from_voxel
    found = np.stack([i, j, k], 1) @ matrix[:3, :3].T + matrix[:3, 3]
    return sorted_places(found)


def sorted_places(found: NDArray[np.float64]) -> NDArray[np.float64]:
    return found[np.lexsort(np.round(found, 3).T)]


def test_the_scan_is_read_as_it_was(written: tuple[Path, Volume, Volume]) -> None:
    folder, scan, _ = written
    found = find_series(folder)
    assert list(found.left_out) == ["Segmentation Storage, no scan"]
    image = choose_series(found.series, None)
    read, *_ = read_series(image)
    for value in (scan.values.min(), scan.values.max()):
        theirs, mine = (places(v, v.values == value) for v in (read, scan))
        assert theirs == pytest.approx(mine, abs=1e-6)
    assert np.array_equal(np.sort(read.values, None), np.sort(scan.values, None))


def test_segments_are_where_highdicom_finds_them(
    written: tuple[Path, Volume, Volume],
) -> None:
    folder, _, labels = written
    seg = highdicom.seg.segread(folder / SEGMENTS)
    told = [seg.get_segment_description(n) for n in seg.segment_numbers]
    assert [str(each.segment_label) for each in told] == [
        "nasal air",
        "optic nerve",
        "orbit",
    ]
    assert [each.segmented_property_type.value for each in told] == [
        *("279549004", "18234004", "363654007")
    ]
    for n, value in enumerate((1, 4, 9)):
        held = seg.get_volume(segment_numbers=[n + 1])
        theirs = held.map_indices_to_reference(np.argwhere(held.array[..., 0] > 0))
        mine = places(labels, labels.values == value)
        assert sorted_places(theirs) == pytest.approx(mine, abs=1e-6)
    # each file says of which slices it is
    uids = {pydicom.dcmread(file).SOPInstanceUID for file in folder.glob("slice*")}
    assert {uid for _, _, uid in seg.get_source_image_uids()} == uids


def test_what_goes_out_comes_in(written: tuple[Path, Volume, Volume]) -> None:
    folder, scan, labels = written
    read = read_labels(folder / SEGMENTS)
    for hazard, values in read.hazards().items():
        value = {name: v for v, name in NAMES.items()}[hazard]
        theirs = places(read.volume, np.isin(read.volume.values, values))
        mine = places(labels, labels.values == value)
        assert theirs == pytest.approx(mine, abs=1e-6)
    assert read.hazards().keys() == {"optic nerve", "orbit"}
    # they are of the scan that lies beside them, and not of one elsewhere
    soft = scan.with_values(np.zeros(SHAPE, np.int16), 0.0)
    check_labels(read, soft)
    away = Volume(soft.values, soft.spacing_mm, soft.origin_mm + 9.0, soft.direction)
    with pytest.raises(UserError, match="lies 9 mm away"):
        check_labels(read, away)


def test_a_segment_of_one_slice_lies_in_its_place(
    written: tuple[Path, Volume, Volume],
) -> None:
    folder, scan, labels = written
    values = labels.values.copy()
    values[:3] = values[4:] = 0
    alone = labels.with_values(values, 0.0)
    for _ in write_dicom(
        *(folder, scan, alone, NAMES, "a"), is_mr=False, version="", made=MADE
    ):
        pass
    read = read_labels(folder / SEGMENTS)
    inside = np.isin(read.volume.values, read.hazards()["orbit"])
    assert places(read.volume, inside) == pytest.approx(
        places(alone, values == 9), abs=1e-6
    )


def test_segments_may_overlap_and_be_fractions(
    written: tuple[Path, Volume, Volume],
) -> None:
    folder, _, labels = written
    slices = [pydicom.dcmread(file) for file in sorted(folder.glob("slice*"))]
    shares = np.random.default_rng(5).random((*SHAPE, 2)).astype(np.float32)
    described = [
        highdicom.seg.SegmentDescription(
            *(n, name, codes.SCT.AnatomicalStructure, codes.SCT.Orbit, "MANUAL")
        )
        for n, name in ((1, "Orbit"), (2, "Optic Nerve_L"))
    ]
    highdicom.seg.Segmentation(
        source_images=slices,
        pixel_array=shares,
        segmentation_type="FRACTIONAL",
        segment_descriptions=described,
        series_instance_uid="1.2.3",
        sop_instance_uid="1.2.4",
        series_number=1,
        instance_number=1,
        device_serial_number="1",
        manufacturer="x",
        manufacturer_model_name="x",
        software_versions="1",
    ).save_as(folder / "fractions.dcm")
    read = read_labels(folder / "fractions.dcm")
    held = read.hazards()
    for n, name in enumerate(("orbit", "optic nerve")):
        # a byte each: 128 of 255 is the first that is half
        inside = np.floor(255 * shares[..., n] + 0.5) >= 127.5
        theirs = places(read.volume, np.isin(read.volume.values, held[name]))
        assert theirs == pytest.approx(places(labels, inside), abs=1e-6)


def test_other_files_of_dicom_are_no_labels(
    written: tuple[Path, Volume, Volume],
) -> None:
    folder, *_ = written
    with pytest.raises(UserError, match="no segmentation"):
        read_labels(folder / "slice-0001.dcm")
    whole = (folder / SEGMENTS).read_bytes()
    for cut in (200, len(whole) // 2, len(whole) - 3):
        (folder / "cut.dcm").write_bytes(whole[:cut])
        with pytest.raises(UserError):
            read_labels(folder / "cut.dcm")


def test_codes_mean_what_dicom_says() -> None:
    known: dict[str, set[str]] = {}
    for name in codes.SCT.dir():
        code = getattr(codes.SCT, name)
        known.setdefault(code.value, set()).add(code.meaning.lower())
    for value, meaning in (STRUCTURE, *(code for _, code in CODES)):
        assert meaning.lower() in known[value]
