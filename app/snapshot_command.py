"""`paravol snapshot`: one high-quality picture, of a session's moment or of a scan."""

import math
import shutil
import tempfile
from pathlib import Path

import msgspec
import numpy as np

from app.operating_room import Progress, prepare_room
from app.rendering_service import running_worker
from app.session_setup import build_session
from app.terminal import Stages, print_json
from renderers.art.client import Snapshot, SnapshotClient
from renderers.art.job import SnapshotRequest
from renderers.scene import Camera, Projection, Scene, save_png
from scenarios import Scenario
from scenarios.bundle import FrameRecord, SampleRecord, read_session

SCAN_FIELD_DEG = 60.0

Corner = tuple[float, float, float]


def run_snapshot(
    *,
    session: Path | None,
    time_s: float,
    volume: Path | None,
    eye: Corner | None,
    target: Corner | None,
    out: Path,
    size: int,
    ranks: int,
    as_json: bool,
) -> int:
    """Render and save; ValueError when the two ways to ask are mixed."""
    if (session is None) == (volume is None):
        raise ValueError("Give either a session folder or --volume, not both.")
    if volume is not None and (eye is None or target is None):
        raise ValueError("A scan needs --eye x y z and --target x y z, in mm (LPS).")
    with Stages() as stages:
        spool = Path(tempfile.mkdtemp(prefix="paravol-spool-"))
        try:
            client = SnapshotClient(spool, name="paravol snapshot")
            if session is not None:
                request = _of_session(client, session, time_s, size, stages)
            else:
                assert volume is not None
                assert eye is not None
                assert target is not None
                request = _of_scan(client, volume, eye, target, size)
            snapshot = _render(client, request, ranks, stages)
            _save(snapshot, out, request)
        finally:
            shutil.rmtree(spool, ignore_errors=True)
    result = snapshot.result
    seconds = result.seconds["total"]
    if as_json:
        print_json({"file": str(out), "result": result})
    else:
        print(f"{out}: {result.width} x {result.height}, {seconds:.1f} s")
    return 0


def _of_session(
    client: SnapshotClient, folder: Path, time_s: float, size: int, progress: Progress
) -> SnapshotRequest:
    # Imported here: building meshes loads a large library.
    from scenarios.instruments import suction_tube

    info, records, _ = read_session(folder)
    scenario = msgspec.json.decode(info.scenario, type=Scenario)
    chosen, gain, number = None, None, 0
    for record in records:
        if isinstance(record, SampleRecord):
            if record.time_s > time_s and chosen is not None:
                break
            chosen = record
        elif isinstance(record, FrameRecord):
            gain, number = record.gain, record.number
    if chosen is None:
        raise ValueError(f"{folder} holds no sample; nothing was recorded.")
    room = prepare_room(scenario, progress)
    matrix = np.array(info.world_from_device).reshape(4, 4)
    view = build_session(scenario, room, matrix, (size, size)).view(chosen.sample())
    tools = ((suction_tube(), view.world_from_instrument),)
    return client.request_scope(
        room.surface,
        view.camera,
        ring_radius_mm=scenario.scope.ring_radius_mm,
        seed=info.seed,
        gain=gain,
        frame_number=number,
        instruments=tools if info.has_instrument else (),
    )


def _of_scan(
    client: SnapshotClient, file: Path, eye: Corner, target: Corner, size: int
) -> SnapshotRequest:
    from anatomy import classic_transfer_function
    from anatomy.files import load_volume

    scene = Scene(load_volume(file), classic_transfer_function())
    camera = Camera.looking_at(
        eye,
        target,
        extent=math.radians(SCAN_FIELD_DEG / 2),
        size=(size, size),
        projection=Projection.PERSPECTIVE,
    )
    return client.request_classic(scene, camera)


def _render(
    client: SnapshotClient, request: SnapshotRequest, ranks: int, progress: Progress
) -> Snapshot:
    stage = "Rendering the snapshot"
    progress(stage, 0.0)
    job = client.submit(request)
    with running_worker(client.spool.folder, ranks=ranks) as worker:
        return client.wait(
            job, lambda share: progress(stage, share), watch=worker.ensure_alive
        )


def _save(snapshot: Snapshot, out: Path, request: SnapshotRequest) -> None:
    text = {"Software": "PARAVOL", "Request": msgspec.json.encode(request).decode()}
    save_png(out, snapshot.pixels(), text)
