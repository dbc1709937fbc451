"""Every reader of foreign bytes: whatever the damage, a value or one sentence."""

import gzip
import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from anatomy.case import read_case
from anatomy.files.markups import read_markups, write_markups
from anatomy.files.surfaces import Surface, load_surface, save_surface
from anatomy.files.volumes import load_volume, save_volume
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Side
from app.errors import sentence
from devices import ProbePath, load_probe_path, save_probe_path
from devices.registration.registration_file import (
    RegistrationRecord,
    load_registration,
    save_registration,
)
from paravol.exchange.flown_path import path_of, read_motions
from paravol.exchange.perktutor import write_perktutor
from paravol.exchange.sequence_file import write_sequence
from paravol.exchange.tool_motion import INSTRUMENT
from paravol.snapshots.camera_path import load_camera_path
from paravol.snapshots.path_state import load_state, save_state
from paravol.snapshots.view_file import load_view
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.request import decode_request
from scenarios import load_scenario
from scenarios.bundle import (
    FrameRecord,
    SampleRecord,
    SessionRecorder,
    read_recording,
)
from tests.paravol.exchange.made_motion import motions
from tests.scenarios.session_info import INFO

ROUNDS = 120

Read = Callable[[Path], object]


def scenario(file: Path) -> Read:
    bundled, folder = load_scenario("first_flight")
    file.write_bytes((folder / f"{bundled.name}.toml").read_bytes())
    return lambda path: load_scenario(str(path))


def case(file: Path) -> Read:
    record = {
        "schema_version": 1,
        "name": "a",
        "sha256": {"ct": "0" * 64, "labels": "0" * 64},
        "label_names": {"1": "air"},
    }
    file.write_text(json.dumps(record))
    return lambda path: read_case(path.parent)


def view(file: Path) -> Read:
    record = {
        "schema": "paravol.view/1",
        "head": {"kind": "phantom", "seed": 1},
        "camera": {"eye_mm": [0, 0, 0], "target_mm": [0, 9, 1], "extent": 0.7},
        "size_px": [512, 512],
        "look": {"mode": "scope", "ring_radius_mm": 0.95},
    }
    file.write_text(json.dumps(record))
    load_view(file)
    return load_view


def camera_path(file: Path) -> Read:
    keys = [
        {"time_s": t, "eye_mm": [0, t, 0], "target_mm": [0, 9, 1]} for t in range(3)
    ]
    file.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    load_camera_path(file)
    return load_camera_path


def request(file: Path) -> Read:
    values = np.zeros((4, 4, 4), np.float32)
    transfer = TransferFunction(
        np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 1.0])
    )
    scene = Scene(Volume(values, np.ones(3), np.zeros(3), background=0.0), transfer)
    camera = Camera.looking_at(
        (1, -9, 1), (1, 1, 1), extent=0.4, projection=Projection.PERSPECTIVE
    )
    client = SnapshotClient(file.parent / "spool")
    file.write_bytes(msgspec.json.encode(client.request_classic(scene, camera)))
    return lambda path: decode_request(path.read_bytes())


def status(file: Path) -> Read:
    client = SnapshotClient(file.parent / "spool")
    attempt = client.spool.attempt_folder("a", 1)
    attempt.mkdir(parents=True)
    file.write_text('{"state":"running","attempt":1,"heartbeat":3,"done":0.5}')

    def read(path: Path) -> object:
        (attempt / "status.json").write_bytes(path.read_bytes())
        return client.spool.status("a")

    return read


def array(file: Path) -> Read:
    buffer = io.BytesIO()
    np.save(buffer, np.arange(24, dtype=np.float32).reshape(2, 3, 4))
    file.write_bytes(buffer.getvalue())
    store = DataStore(file.parent)

    def read(path: Path) -> object:
        named = path.parent / ("0" * 64)
        named.write_bytes(path.read_bytes())
        return store.get(named.name, ("float32",), 1 << 20)

    return read


def volume(file: Path) -> Read:
    values = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    save_volume(Volume(values, np.ones(3), np.zeros(3)), file)
    load_volume(file)
    return load_volume


def zipped(file: Path) -> Read:
    plain = file.with_suffix("")
    volume(plain)
    file.write_bytes(gzip.compress(plain.read_bytes()))
    return load_volume


def surface(file: Path) -> Read:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float64)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    save_surface(Surface(corners, faces), file)
    load_surface(file)
    return load_surface


def markups(file: Path) -> Read:
    mark = Landmark("tip", Side.LEFT, np.array([1.0, 2.0, 3.0]), 2.0)
    write_markups({mark.key: mark}, file)
    read_markups(file)
    return read_markups


def registration(file: Path) -> Read:
    record = RegistrationRecord(
        world_from_device=tuple(np.eye(4).ravel().tolist()),
        tip_mm=(0.0, 0.0, 0.0),
        arm_serial="1",
        arm_model="DX",
        head="head",
        created="2000-01-01T00:00:00+00:00",
        landmarks=(),
        residual_rms_mm=0.2,
        traced_points=0,
        surface_rms_mm=0.0,
        targets={"a": 0.1},
        budget_mm=0.75,
    )
    save_registration(file, record)
    load_registration(file)
    return load_registration


def probe_path(file: Path) -> Read:
    n = 4
    axis = np.tile([0.0, 1.0, 0.0], (n, 1))
    path = ProbePath(
        name="p",
        t_s=np.linspace(0.0, 0.3, n),
        tip_mm=np.zeros((n, 3)),
        axis=axis,
        roll_deg=np.zeros(n),
        instrument_tip_mm=np.zeros((n, 3)),
        instrument_axis=axis,
        buttons=np.zeros(n, np.int64),
    )
    save_probe_path(path, file)
    load_probe_path(file)
    return load_probe_path


def paths_of_light(file: Path) -> Read:
    save_state(file, np.zeros((2, 2, 7)), "key")
    return lambda path: load_state(path, "key")


def session(file: Path) -> Read:
    """The stream, or the description beside it."""
    folder = file.parent / "made"
    with SessionRecorder(folder, INFO) as recorder:
        for i in range(120):
            numbers = np.eye(4).ravel().tolist()
            recorder.add(SampleRecord(i * 0.01, numbers, 0.0, [0.0] * 3, [0.0] * 3, 0))
            recorder.add(FrameRecord(i, i, 1.0, 0.25, "a" * 32))
    for made in ("stream.mcap", "session.json"):
        (file.parent / made).write_bytes((folder / made).read_bytes())
    read_recording(file.parent)
    return lambda path: read_recording(path.parent)


def motion_of_tools(file: Path) -> Read:
    write = write_perktutor if file.suffix == ".xml" else write_sequence
    write(file, motions())
    return lambda path: path_of(read_motions(path), "p", instrument=INSTRUMENT)


READERS: dict[str, Callable[[Path], Read]] = {
    "a.toml": scenario,
    "case.json": case,
    "a.view.json": view,
    "keys.json": camera_path,
    "request.json": request,
    "said.json": status,
    "a.npy": array,
    "a.nrrd": volume,
    "a.nii": volume,
    "a.nii.gz": zipped,
    "a.mha": volume,
    "a.ply": surface,
    "a.stl": surface,
    "a.vtp": surface,
    "a.mrk.json": markups,
    "registration.json": registration,
    "a.path.json": probe_path,
    "a.npz": paths_of_light,
    "stream.mcap": session,
    "session.json": session,
    "a.xml": motion_of_tools,
    "a.seq.mha": motion_of_tools,
    "a.seq.nrrd": motion_of_tools,
}


def damages(whole: bytes, seed: int) -> Iterator[bytes]:
    """Cut, change, repeat and replace; what a header says is hit more often."""
    random = np.random.default_rng(seed)
    yield b""
    yield b"\xff" * 40
    yield b"[" * 20_000
    yield b'{"a":' * 20_000
    yield b"a=" + b"[" * 5_000
    for _ in range(ROUNDS):
        made = bytearray(whole)
        at = int(random.integers(len(whole)))
        if random.random() < 0.5:
            at = int(random.integers(min(len(whole), 400)))
        match int(random.integers(5)):
            case 0:
                made = made[:at]
            case 1:
                made[at] ^= 1 << int(random.integers(8))
            case 2:
                made[at : at + 8] = random.bytes(8)
            case 3:
                made[at:at] = made[at : at + int(random.integers(1, 60))]
            case 4:
                # an unended header: the rest is blank
                made[at:] = b" " * (len(made) - at)
        yield bytes(made)


def is_told(error: Exception) -> bool:
    """Tell whether an error is ours, and a person is told one sentence."""
    ours = type(error) is ValueError or type(error).__module__.startswith(
        ("disk.", "devices.", "renderers.art.", "renderers.snapshots.")
    )
    told = sentence(error)
    return ours and bool(told) and "\n" not in str(told)


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_damage_is_one_sentence(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    read = READERS[name](file)
    whole = file.read_bytes()
    refused = 0
    for number, content in enumerate(damages(whole, sum(name.encode()))):
        file.write_bytes(content)
        try:
            read(file)
        except Exception as error:
            if not is_told(error):
                raise AssertionError((number, content[:80])) from error
            refused += 1
    print(f"{name}: {refused} refused")
    assert refused >= (1 if name == "stream.mcap" else 5)


def test_an_array_without_its_headers_end(tmp_path: Path) -> None:
    """numpy's parser of headers raised `tokenize.TokenError`."""
    read = array(tmp_path / "a.npy")
    whole = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(whole[:40] + b" " * 87 + b"\n" + whole[128:])
    with pytest.raises(ValueError, match="cannot be read as an array"):
        read(tmp_path / "a.npy")
