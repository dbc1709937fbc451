import json
import os
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.registration.fiducial_fit import RegistrationError, RegistrationReason
from devices.registration.registration_file import (
    PivotRecord,
    RegistrationRecord,
    TouchedLandmark,
    load_registration,
    save_itk_transform,
    save_registration,
)


def _transform() -> NDArray[np.float64]:
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_rotvec([0.3, -1.2, 0.4]).as_matrix()
    transform[:3, 3] = (230.0, -14.5, 81.25)
    return transform


def _record() -> RegistrationRecord:
    return RegistrationRecord(
        world_from_device=tuple(_transform().ravel().tolist()),
        tip_mm=(0.0, 0.0, -14.0),
        arm_serial="EMU00001",
        arm_model="DX",
        head="first_flight, seed 1",
        created="2000-01-01T00:00:00+00:00",
        landmarks=(
            TouchedLandmark("nasion", (1.0, -14.0, 50.0), (7.0, 8.0, 9.0), 0.2, 0.1),
        ),
        residual_rms_mm=0.2,
        traced_points=0,
        surface_rms_mm=0.0,
        targets={"sphenoid ostium, left": 0.5, "frontal ostium, left": 0.3},
        budget_mm=0.75,
        pivot=PivotRecord(0.1, 4.0, 0.02),
    )


def test_a_record_survives_the_disk_to_the_bit(tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    save_registration(file, _record())
    back = load_registration(file)
    assert back == _record()
    np.testing.assert_array_equal(back.registration().world_from_device, _transform())
    assert back.registration().residual_rms_mm == 0.2
    assert os.listdir(tmp_path) == ["r.json"]


def test_the_budget_is_met_by_all_targets_or_not_met() -> None:
    assert _record().within_budget
    assert not msgspec.structs.replace(_record(), budget_mm=0.4).within_budget


def test_itk_finds_the_device_s_point_for_the_patient_s(tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    file = tmp_path / "r.tfm"
    save_itk_transform(file, _transform())
    assert file.read_text().startswith("#Insight Transform File")
    device = np.array([12.0, -7.0, 133.0])
    patient = (_transform() @ np.append(device, 1.0))[:3]
    found = sitk.ReadTransform(str(file)).TransformPoint(patient.tolist())
    np.testing.assert_allclose(found, device, atol=1e-9)
    assert os.listdir(tmp_path) == ["r.tfm"]
    with pytest.raises(ValueError, match=r"\.tfm"):
        save_itk_transform(tmp_path / "r.h5", _transform())


def _spoilt(**changes: object) -> bytes:
    return json.dumps({**msgspec.to_builtins(_record()), **changes}).encode()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe",
        b"[]",
        b'{"format": "something else"}',
        _spoilt(version=2),
        _spoilt(unknown=1),
        _spoilt(world_from_device=[1.0] * 16),
        _spoilt(world_from_device=[1.0] * 15),
        _spoilt(tip_mm=[0.0, 0.0]),
    ],
)
def test_what_is_no_registration_is_refused(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    file.write_bytes(content)
    with pytest.raises(RegistrationError, match=r"r\.json.* regist") as caught:
        load_registration(file)
    assert caught.value.reason is RegistrationReason.FILE


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(RegistrationError, match="paravol register"):
        load_registration(tmp_path / "none.json")


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    save_registration(file, _record())
    before = file.read_bytes()
    broken = msgspec.structs.replace(_record(), residual_rms_mm=float("nan"))
    with pytest.raises(ValueError, match="JSON compliant"):
        save_registration(file, broken)
    assert file.read_bytes() == before
    assert os.listdir(tmp_path) == ["r.json"]
