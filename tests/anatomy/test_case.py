import json
from pathlib import Path

import numpy as np
import pytest

from anatomy.case import read_case, write_case
from anatomy.files.volumes import load_volume, save_volume
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom, head_skin
from anatomy.phantom.synthetic_mr import magnetic_resonance
from anatomy.redistance import DEEPEST_MM
from anatomy.scan.histogram import find_peaks, transfer_of
from anatomy.tissue import Label
from renderers.scene.volume import Volume
from tests.slow_cases import slow


@pytest.fixture(scope="module")
def head() -> Phantom:
    """A head that is not its own mirror image."""
    box = ((-20.0, 16.0), (-10.0, 40.0), (-4.0, 40.0))
    parameters = PhantomParameters(septal_deviation_mm=5.0, seed=3)
    return build_phantom(parameters, 1.0, field_mm=box)


def test_an_asymmetric_head_survives_writing_and_reading(
    head: Phantom, tmp_path: Path
) -> None:
    assert not np.array_equal(head.ct.values, head.ct.values[:, :, ::-1])
    write_case(head, tmp_path / "case")
    case = read_case(tmp_path / "case")
    for mine, theirs in ((head.ct, case.ct), (head.labels, case.labels)):
        assert np.array_equal(mine.values, theirs.values)
        assert mine.values.dtype == theirs.values.dtype
        assert theirs.world_from_voxel == pytest.approx(mine.world_from_voxel)
    assert case.record.parameters == head.parameters
    places = {f"face {n}" for n in (1, 2, 3, 4)}
    assert case.landmarks.keys() == head.landmarks.keys() | places
    for key in head.landmarks:
        landmark = case.landmarks[key]
        assert np.array_equal(landmark.position_mm, head.landmarks[key].position_mm)
        assert landmark.radius_mm == head.landmarks[key].radius_mm
    tip = case.landmarks["inferior turbinate head, left"].position_mm
    assert tip[0] > 0
    i, j, k = np.round((tip - case.ct.origin_mm) / 1.0).astype(int)
    assert case.labels.values[k, j, i] == Label.INFERIOR_TURBINATE
    names = {p.name for p in (tmp_path / "case").iterdir()}
    volumes = {f"{name}.nrrd" for name in ("ct", "distance", "blood", "skin", "face")}
    volumes |= {"walls.nrrd", "ground.nrrd"}
    volumes |= {f"hazard-{n.replace(' ', '-')}.nrrd" for n in head.hazards.names}
    assert names == {
        *volumes, "labels.seg.nrrd", "landmarks.mrk.json", "case.json"
    }  # fmt: skip
    for name in ("distance", "blood", "skin"):
        mine = getattr(head, name)
        assert np.array_equal(case.volumes[name].values, mine.values)
        assert case.volumes[name].background == mine.background


def test_a_phantom_has_the_skin_of_its_whole_head(
    head: Phantom, tmp_path: Path
) -> None:
    write_case(head, tmp_path)
    case = read_case(tmp_path)
    face = case.volumes["face"]
    assert np.array_equal(face.values, head_skin(head.parameters).values)
    assert face.background == DEEPEST_MM
    places = [m for name, m in case.landmarks.items() if name.startswith("face ")]
    assert len(places) == 4
    off = face.sample(np.stack([place.position_mm for place in places]))
    assert np.abs(off).max() < 0.3


def test_mr_is_hashed_like_the_rest(head: Phantom, tmp_path: Path) -> None:
    write_case(head, tmp_path, resonance=True)
    case = read_case(tmp_path)
    assert {"t1", "t2"} < case.record.sha256.keys()
    for mine, name in zip(magnetic_resonance(head), ("t1", "t2"), strict=True):
        assert case.volumes[name].values.tobytes() == mine.values.tobytes()
    (tmp_path / "t2.nrrd").replace(tmp_path / "t1.nrrd")
    write_case(head, tmp_path / "other", resonance=True)
    (tmp_path / "other" / "t2.nrrd").replace(tmp_path / "t2.nrrd")
    with pytest.raises(ValueError, match="holds a t1 volume that is not the one"):
        read_case(tmp_path)
    # written anew without MR, none is left over
    write_case(head, tmp_path)
    assert not (tmp_path / "t1.nrrd").exists()


def test_the_transfer_function_comes_back_bit_for_bit(
    head: Phantom, tmp_path: Path
) -> None:
    write_case(head, tmp_path)
    stored = read_case(tmp_path).record.transfer
    assert stored is not None
    mine, again = transfer_of(find_peaks(head.ct)), stored.function()
    for one, other in (
        (mine.nodes, again.nodes),
        (mine.color, again.color),
        (mine.kappa_per_mm, again.kappa_per_mm),
    ):
        assert one.tobytes() == other.tobytes()


def test_segments_carry_their_names(head: Phantom, tmp_path: Path) -> None:
    write_case(head, tmp_path)
    header = (tmp_path / "labels.seg.nrrd").read_bytes().split(b"\n\n")[0].decode()
    assert "Segment0_ID:=" in header
    assert "_Name:=inferior turbinate" in header
    assert f"_LabelValue:={int(Label.INFERIOR_TURBINATE)}" in header


@pytest.mark.parametrize(
    "name", [*("ct.nrrd", "case.json"), *slow("labels.seg.nrrd", "landmarks.mrk.json")]
)
def test_a_missing_or_foreign_file_is_named(
    head: Phantom, tmp_path: Path, name: str
) -> None:
    write_case(head, tmp_path)
    (tmp_path / name).write_bytes(b"something else")
    with pytest.raises(ValueError, match=name.replace(".", r"\.")):
        read_case(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(ValueError, match=name.replace(".", r"\.")):
        read_case(tmp_path)


@pytest.mark.parametrize(
    ("spacing", "origin"), [(1.3, 0.0), (1.0, 5.0), (1.001, 0.0), (1.0, -0.01)]
)
def test_a_head_of_another_size_or_place_is_noticed(
    head: Phantom, tmp_path: Path, spacing: float, origin: float
) -> None:
    """All its values are the same, and all its volumes share the other grid."""
    write_case(head, tmp_path)
    for file in tmp_path.glob("*.nrrd"):
        if file.name != "face.nrrd":
            old = load_volume(file, 0.0)
            moved = Volume(old.values, old.spacing_mm * spacing, old.origin_mm + origin)
            save_volume(moved, file)
    with pytest.raises(ValueError, match=r"nrrd lies elsewhere .* than case.json says"):
        read_case(tmp_path)


def test_a_case_of_before_is_read(head: Phantom, tmp_path: Path) -> None:
    """Its record does not say where its volumes lie."""
    write_case(head, tmp_path)
    record = json.loads((tmp_path / "case.json").read_text())
    assert set(record.pop("frames")) <= {"ct", "face"}
    (tmp_path / "case.json").write_text(json.dumps(record))
    assert read_case(tmp_path).record.frames == {}
