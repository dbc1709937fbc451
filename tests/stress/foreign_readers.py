"""Every reader of foreign bytes, with a sound file for each.

`READERS` has readers of files: each writes a sound one and returns how it is read.
`STREAMS` has readers of bytes from a line. Whatever comes, a reader gives a value or
raises an error that a person is told in one sentence.
"""

import gzip
import io
import json
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np
from pyigtl import TransformMessage

from anatomy.case import read_case
from anatomy.files.dicom_export import SEGMENTS, write_dicom
from anatomy.files.markups import read_markups, write_markups
from anatomy.files.segments import segment_fields
from anatomy.files.surfaces import Surface, load_surface, save_surface
from anatomy.files.volumes import load_volume, save_volume
from anatomy.queries.landmarks import Landmark
from anatomy.scan.dicom import find_series, read_series
from anatomy.scan.label_file import read_labels
from anatomy.tissue import Side
from app.errors import sentence
from devices import ProbePath, load_probe_path, save_probe_path
from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.commands import Query
from devices.microscribe.wire.packets import PacketLayout
from devices.microscribe.wire.protocol import TRANSITIONS, HostSession, State, Step
from devices.openigtlink.messages import ToolTransform, TransformReader, encode
from devices.registration.registration_file import (
    RegistrationRecord,
    load_registration,
    save_registration,
)
from paravol.exchange.flown_path import path_of, read_motions
from paravol.exchange.perktutor import write_perktutor
from paravol.exchange.sequence_file import write_sequence
from paravol.exchange.tool_motion import INSTRUMENT
from paravol.sessions.session_store import SessionStore
from paravol.snapshots.camera_path import load_camera_path
from paravol.snapshots.path_state import load_state, save_state
from paravol.snapshots.view_file import load_view
from paravol.volume.look import LookPoint, VolumeLook, load_look, save_look
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.request import decode_request
from scenarios import load_scenario
from scenarios.bundle import FrameRecord, Record, SampleRecord, read_recording
from scenarios.bundle.notes import add_note, read_notes
from scenarios.metrics.settings import load_settings
from scenarios.rubrics.population import bundled_populations, load_population
from scenarios.rubrics.rubric import SHIPPED, load_rubric
from tests.dicom_files import write_stack
from tests.paravol.exchange.made_motion import motions
from tests.recorded_flight import write_records
from tests.scenarios.session_info import INFO

Read = Callable[[Path], object]


def sound(read: Read, file: Path) -> Read:
    """Give a reader that reads what was made."""
    read(file)
    return read


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
    return sound(load_view, file)


def camera_path(file: Path) -> Read:
    keys = [
        {"time_s": t, "eye_mm": [0, t, 0], "target_mm": [0, 9, 1]} for t in range(3)
    ]
    file.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    return sound(load_camera_path, file)


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
    return sound(load_volume, file)


def zipped(file: Path) -> Read:
    plain = file.with_suffix("")
    volume(plain)
    file.write_bytes(gzip.compress(plain.read_bytes()))
    return load_volume


def surface(file: Path) -> Read:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float64)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    save_surface(Surface(corners, faces), file)
    return sound(load_surface, file)


def markups(file: Path) -> Read:
    mark = Landmark("tip", Side.LEFT, np.array([1.0, 2.0, 3.0]), 2.0)
    write_markups({mark.key: mark}, file)
    return sound(read_markups, file)


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
    return sound(load_registration, file)


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
    return sound(load_probe_path, file)


def paths_of_light(file: Path) -> Read:
    save_state(file, np.zeros((2, 2, 7)), "key")
    return lambda path: load_state(path, "key")


def session(file: Path) -> Read:
    """The stream, or the description beside it."""
    folder, numbers = file.parent / "made", np.eye(4).ravel().tolist()
    records: list[Record] = []
    for i in range(120):
        records += [
            SampleRecord(i * 0.01, numbers, 0.0, [0.0] * 3, [0.0] * 3, 0),
            FrameRecord(i, i, 1.0, 0.25, "a" * 32),
        ]
    write_records(folder, INFO, records)
    for made in ("stream.mcap", "session.json"):
        (file.parent / made).write_bytes((folder / made).read_bytes())
    read_recording(file.parent)
    return lambda path: read_recording(path.parent)


def motion_of_tools(file: Path) -> Read:
    write = write_perktutor if file.suffix == ".xml" else write_sequence
    write(file, motions())
    return lambda path: path_of(read_motions(path), "p", instrument=INSTRUMENT)


def look(file: Path) -> Read:
    points = (LookPoint(0.0, "#000000", 0.0), LookPoint(300.0, "#ffe0c0", 0.5))
    save_look(VolumeLook("bone", points, 300.0), file)
    return sound(load_look, file)


def rubric(file: Path) -> Read:
    file.write_bytes((SHIPPED / "operation.toml").read_bytes())
    load_rubric(str(file))
    return lambda path: load_rubric(str(path))


def population(file: Path) -> Read:
    file.write_bytes(bundled_populations()["hoops"].read_bytes())
    return sound(load_population, file)


def notes(file: Path) -> Read:
    (file.parent / "session.json").touch()
    add_note(file.parent, 1.5, "Slower here")
    read_notes(file.parent)
    return lambda path: read_notes(path.parent)


def metrics_settings(file: Path) -> Read:
    file.write_text("rest_mm_s = 4.0\n[margins_mm]\norbit = 3.0\n")
    return sound(load_settings, file)


def labels(file: Path) -> Read:
    values = np.zeros((3, 4, 5), np.int16)
    values[1] = 1
    save_volume(Volume(values, np.ones(3), np.zeros(3)), file)
    names = '{"1": "optic nerve"}'
    names_file = file.parent / "names.json"
    names_file.write_text(names)
    read_labels(file, str(names_file))
    return lambda path: read_labels(path, str(names_file))


def segments(file: Path) -> Read:
    """Labels that carry their names."""
    values = np.zeros((3, 4, 5), np.uint8)
    values[1] = 1
    labels, names = Volume(values, np.ones(3), np.zeros(3)), {1: "optic nerve"}
    if file.suffix == ".dcm":
        made = datetime(2026, 1, 1)
        scan = labels.with_values(values.astype(np.int16), 0.0)
        for _ in write_dicom(
            *(file.parent, scan, labels, names, "a"), is_mr=False, version="", made=made
        ):
            pass
        (file.parent / SEGMENTS).rename(file)
    else:
        save_volume(labels, file, segment_fields(names, labels.shape))
    assert read_labels(file).hazards()
    return read_labels


def listed_marks(file: Path) -> Read:
    file.write_text(
        "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
        "1,1.5,-2,3,0,0,0,1,1,1,0,nostril,,\n"
    )
    assert read_markups(file)
    return read_markups


def dicom(file: Path) -> Read:
    """One slice of a series, with its preamble or without; the others are sound."""
    folder = file.parent / "series"
    write_stack(folder)
    slice_ = folder / "000"
    content = slice_.read_bytes()
    file.write_bytes(content[132:] if file.stem == "bare" else content)

    def read(path: Path) -> object:
        slice_.write_bytes(path.read_bytes())
        return [read_series(series) for series in find_series(folder).series]

    return sound(read, file)


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
    "a.look.json": look,
    "a.rubric.toml": rubric,
    "population.json": population,
    "notes.json": notes,
    "settings.toml": metrics_settings,
    "labels.nrrd": labels,
    "labels.seg.nrrd": segments,
    "labels.dcm": segments,
    "a.fcsv": listed_marks,
    "slice.dcm": dicom,
    "bare.dcm": dicom,
}


def hear_packets(data: bytes) -> object:
    """A driver hears bytes in every state; 0xF0 to 0xF4 say what it asks meanwhile."""
    session = HostSession(confirmed_only=len(data) % 2 == 1)
    heard: list[object] = []
    at = 0
    while at < len(data):
        code, following = data[at], data[at + 1 : at + 2] or b"\0"
        at += 1
        idle = session.state is State.IDLE
        match code:
            case 0xF0:
                session.clear()
                session.sign_on()
                session.receive(b"IMMC")
                session.begin()
                session.receive(b"MicroScribe\0")
            case 0xF1 if idle:
                session.poll(PacketLayout(following[0] & 0x2F))
            case 0xF2 if idle:
                session.stream(5)
            case 0xF3 if idle:
                session.ask(list(Query)[following[0] % len(Query)])
            case 0xF4 if TRANSITIONS[session.state, Step.ABANDON] is not None:
                session.abandon()
            case _:
                heard += session.receive(bytes((code,)))
    return heard


def hear_commands(data: bytes) -> object:
    """An emulated arm hears what no host would say."""
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), 0.0)
    return [firmware.receive(data[n : n + 3], n * 1e-3) for n in range(0, len(data), 3)]


def hear_trackers(data: bytes) -> object:
    """Transforms are cut out of bytes, whole and in pieces; the same are found."""
    whole = TransformReader().feed(data)
    reader = TransformReader()
    pieces = [t for n in range(0, len(data), 5) for t in reader.feed(data[n : n + 5])]
    assert len(pieces) == len(whole)
    return whole


def hear_names(data: bytes) -> object:
    """Files of any name lie where programs look for their own."""
    name = data.replace(b"\0", b"").replace(b"/", b"")[:80]
    if name in (b"", b".", b".."):
        return None
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        client = SnapshotClient(folder / "spool")
        spool = client.spool
        write_stack(folder / "scan", 3)
        mask = Volume(np.ones((3, 3, 3), np.uint8), np.ones(3), np.zeros(3))
        (folder / "masks").mkdir()
        save_volume(mask, folder / "masks" / "optic_nerve_left.nii")
        (folder / "kept").mkdir()
        for where in (spool.queue, spool.jobs, *folder.iterdir()):
            stray = os.path.join(os.fsencode(where), name)
            with suppress(OSError):
                os.mkdir(stray) if data[0] & 1 else os.close(os.open(stray, os.O_CREAT))
        kept = SessionStore(folder / "kept", 0)
        assert kept.sessions() == kept.make_room() == []
        assert spool.claim() is None
        assert spool.take_over() is None
        found: list[object] = []
        for read, here in ((find_series, "scan"), (read_labels, "masks")):
            try:
                found.append(read(folder / here))
            except Exception as error:
                if not is_told(error):
                    raise
        return found


Hear = Callable[[bytes], object]


def remarked() -> bytes:
    """Return a transform with what PLUS says of it, as pyigtl writes that."""
    message = TransformMessage(np.eye(4), device_name="scope", timestamp=0.25)
    message.header_version = 2
    message.metadata = {
        "TransformStatus": "OK",
        "IGTL_DEVICE_NAME": "ScopeTipToReferenceOfTheTracker",
    }
    packed: bytes = message.pack()
    return packed


STREAMS: dict[str, tuple[bytes, Hear]] = {
    "packets": (b"\xf0\xf3\x04\xc8name\0\xf1\x23\xa3" + bytes(40), hear_packets),
    "commands": (b"\xc5IMMCBEGIN\xc8\xc0\x3f\xd1\x00\x05", hear_commands),
    "trackers": (encode(ToolTransform("scope", 0.25, np.eye(4))), hear_trackers),
    "remarks": (remarked(), hear_trackers),
    "names": (b"5-.json", hear_names),
}


def is_told(error: Exception) -> bool:
    """Tell whether an error is ours, and a person is told one sentence."""
    ours = type(error) is ValueError or type(error).__module__.startswith(
        ("system.", "devices.", "renderers.art.", "renderers.snapshots.")
    )
    told = sentence(error)
    return ours and bool(told) and "\n" not in str(told)
