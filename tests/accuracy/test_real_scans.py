"""Two real heads, imported and looked into: a CT with a tilted gantry and an MR.

The scans are no part of the project. They are looked for beside it, in
``shared/data``, or where ``PARAVOL_TEST_SCANS`` says.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import UID, ExplicitVRLittleEndian, generate_uid

from anatomy.case import read_case
from anatomy.scan.imported import ImportedHead, import_head
from anatomy.scan.imported_case import source_record, write_imported_case
from anatomy.scan.scan import Modality, Scan, read_scan
from anatomy.tissue import Side
from devices import load_probe_path
from paravol.exercises.case_scenario import scenario_of_case
from paravol.patient import PatientScene, load_patient
from paravol.sessions.session_setup import build_view, path_view
from scenarios import load_scenario

SCANS = Path(
    os.environ.get("PARAVOL_TEST_SCANS")
    or Path(__file__).parents[3] / "shared" / "data"
)
CT, MR = SCANS / "head_ct_ge_tilt.npz", SCANS / "head_mr_t1c.nii.gz"

needs_ct = pytest.mark.skipif(not CT.exists(), reason="the CT is not here")
needs_mr = pytest.mark.skipif(not MR.exists(), reason="the MR is not here")


class Slices:
    """The CT's slices with their own geometry, as arrays."""

    def __init__(self) -> None:
        with np.load(CT, allow_pickle=False) as file:
            self.hu: NDArray[np.int16] = file["hu"]
            self.positions: NDArray[np.float64] = file["ipp_lps_mm"]
            self.row: NDArray[np.float64] = file["row_dir"]
            self.column: NDArray[np.float64] = file["col_dir"]
            self.spacing: NDArray[np.float64] = file["pixel_spacing_mm"]

    def world(self, k: int) -> NDArray[np.float64]:
        """Give where a slice's pixels lie, ``(rows, columns, 3)``."""
        rows, columns = (np.arange(n) for n in self.hu.shape[1:])
        across = columns[None, :, None] * self.spacing[1] * self.row
        down = rows[:, None, None] * self.spacing[0] * self.column
        place: NDArray[np.float64] = self.positions[k] + across + down
        return place

    def write(self, folder: Path, pixels: NDArray[np.int16]) -> None:
        """Write pixels of the CT's shape as DICOM files, last slice first."""
        folder.mkdir()
        for k in range(len(pixels)):
            meta = FileMetaDataset()
            meta.MediaStorageSOPClassUID = UID("1.2.840.10008.5.1.4.1.1.2")
            meta.MediaStorageSOPInstanceUID = generate_uid()
            meta.TransferSyntaxUID = ExplicitVRLittleEndian
            image = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
            image.SOPClassUID = meta.MediaStorageSOPClassUID
            image.SOPInstanceUID = meta.MediaStorageSOPInstanceUID
            image.SeriesInstanceUID = "1.2.3"
            image.Modality = "CT"
            image.Rows, image.Columns = pixels.shape[1:]
            image.BitsAllocated = image.BitsStored = 16
            image.HighBit, image.PixelRepresentation = 15, 1
            image.SamplesPerPixel = 1
            image.PhotometricInterpretation = "MONOCHROME2"
            image.ImagePositionPatient = [f"{v:.7f}" for v in self.positions[k]]
            axes = (*self.row, *self.column)
            image.ImageOrientationPatient = [f"{v:.7f}" for v in axes]
            image.PixelSpacing = [f"{v:.7f}" for v in self.spacing]
            image.RescaleSlope, image.RescaleIntercept = 1, 0
            image.PixelData = pixels[k].tobytes()
            file = folder / f"{len(pixels) - k:03d}.dcm"
            image.save_as(file, enforce_file_format=True)


@pytest.fixture(scope="module")
def ct(tmp_path_factory: pytest.TempPathFactory) -> Scan:
    folder = tmp_path_factory.mktemp("ct") / "dicom"
    slices = Slices()
    slices.write(folder, slices.hu)
    return read_scan(folder)


@pytest.fixture(scope="module")
def head(ct: Scan) -> ImportedHead:
    return import_head(ct, 0.7)


# tests/anatomy/scan/test_dicom.py does so with a tilted, uneven made head.
@pytest.mark.slow
@needs_ct
def test_every_voxel_is_where_its_slice_was(tmp_path: Path) -> None:
    """Pixels that hold their own coordinate, on the real tilted, uneven slices.

    Stored in tenths of a millimetre: the rounding alone is 0.05 mm.
    """
    from anatomy.scan.dicom import choose_series, find_series, layout_notes, read_series

    slices = Slices()
    rng = np.random.default_rng(0)
    for axis in range(3):
        places = np.stack([slices.world(k)[..., axis] for k in range(28)])
        folder = tmp_path / str(axis)
        slices.write(folder, np.rint(10 * places).astype(np.int16))
        volume, layout = read_series(choose_series(find_series(folder).series, None))
        notes = layout_notes(layout, volume)
        assert "tilted by 18.5 degrees" in notes[0]
        for k in range(28):
            # beyond, the slices above and below have no pixels: they are shifted
            inner = slices.world(k)[12:-12, 3:-3].reshape(-1, 3)
            some = inner[rng.integers(0, len(inner), 200)]
            # the ends may lie outside by a rounding of the header
            value = volume.sample(some)
            known = value != volume.background
            assert known.all() or k in (0, 27)
            error = np.abs(value[known] / 10 - some[known, axis])
            assert error.max(initial=0.0) < 0.3


@needs_ct
def test_the_head_looks_the_same_from_every_slice(ct: Scan) -> None:
    """And not the same in a mirror: left and right have not been exchanged."""
    slices = Slices()
    assert ct.modality is Modality.CT
    for k in (2, 5, 8):
        here = slices.world(k)[100:400:3, 60:452:3]
        mine = np.maximum(slices.hu[k, 100:400:3, 60:452:3], -1024.0).ravel()
        found = ct.volume.sample(here.reshape(-1, 3))
        mirrored = found.reshape(here.shape[:2])[:, ::-1].ravel()
        assert np.corrcoef(mine, found)[0, 1] > 0.98
        assert np.corrcoef(mine, mirrored)[0, 1] < 0.9


@needs_ct
def test_the_ct_has_a_nose(head: ImportedHead) -> None:
    assert 10 < head.airways.airway_ml < 80
    # orbits and turbinates are tissue, the passages beside the septum are air
    assert head.approach is not None
    assert head.approach.free_mm >= 20
    assert head.distance.sample(head.approach.pivot_mm) < -0.5
    # in the nose, which lies 12 degrees aslant, on the right of its septum
    assert abs(float(head.midplane.aside(head.approach.pivot_mm))) < 12
    assert head.midplane.agreement > 0.9
    assert head.approach.pivot_mm[1] < -70
    deep = head.airways.labels.values == 1
    assert (head.distance.values[deep] < 0).all()
    assert any("cut" in note for note in head.notes)


def room_of(
    scan: Scan, head: ImportedHead, folder: Path
) -> tuple[PatientScene, NDArray[np.uint8]]:
    """Keep a head as a case, read it back, and look from the middle of its flight."""
    write_imported_case(head, (source_record(scan, "test"),), folder)
    scenario, place = load_scenario(str(scenario_of_case(folder)))
    patient = load_patient(scenario, lambda stage, share: None)
    path = load_probe_path(place / scenario.path)
    view = build_view(
        scenario, patient, tier="LIVE", seed=1, has_instrument=False, threads=1
    )
    seen = path_view(scenario, patient, path, 0.4 * path.duration_s, (200, 200))
    frame = view.draw(seen, number=0, elapsed_s=0.0)
    covered = np.asarray(frame.gbuffer.coverage) > 0.5
    assert covered.mean() > 0.5
    return patient, frame.pixels


def check_picture(pixels: NDArray[np.uint8]) -> None:
    """Pink, lit, and not the same everywhere."""
    middle = pixels[50:150, 50:150].reshape(-1, 3).astype(float)
    red, green, _ = middle.mean(axis=0)
    assert red > 30
    assert red > 1.1 * green
    assert middle[:, 0].std() > 5


@needs_ct
@pytest.mark.slow
def test_the_ct_is_flown_through(ct: Scan, head: ImportedHead, tmp_path: Path) -> None:
    patient, pixels = room_of(ct, head, tmp_path)
    check_picture(pixels)
    case = read_case(tmp_path)
    assert np.array_equal(case.ct.values, head.ct.values)
    assert case.record.sources[0].modality == "CT"
    assert patient.way_in is not None
    assert head.approach is not None
    assert np.array_equal(patient.way_in.pivot_mm, head.approach.pivot_mm)
    # its own histogram's transfer function is what classic mode draws with
    assert case.record.transfer is not None
    stored = case.record.transfer.function()
    assert np.array_equal(patient.scene.transfer_function.nodes, stored.nodes)


@needs_mr
@pytest.mark.slow
def test_the_mr_is_flown_through(tmp_path: Path) -> None:
    scan = read_scan(MR)
    assert scan.modality is Modality.MR
    head = import_head(scan, 0.8)
    # the face is blanked: nobody enters by a nostril, and dark bone is no way in
    assert not any(name.startswith("nostril,") for name in head.landmarks)
    assert head.approach is None
    assert any("name the entrance with --pivot" in note for note in head.notes)
    write_imported_case(head, (source_record(scan, "test"),), tmp_path / "no way")
    with pytest.raises(ValueError, match="import the scan again with --pivot"):
        scenario_of_case(tmp_path / "no way")
    # both maxillary sinuses, each on its side, one air with the nose here
    right, left = (
        max(
            (c for c in head.spaces.chambers if c.side is side),
            key=lambda c: c.volume_ml,
        )
        for side in (Side.RIGHT, Side.LEFT)
    )
    assert 15 < right.volume_ml < 28
    assert 15 < left.volume_ml < 28
    assert right.center_mm[0] < -15
    assert left.center_mm[0] > 15
    assert abs(right.center_mm[2] - left.center_mm[2]) < 8
    choana = np.array([4.1, -68.6, -52.5])
    head = import_head(scan, 0.8, pivot_mm=choana)
    _, pixels = room_of(scan, head, tmp_path / "way")
    check_picture(pixels)
