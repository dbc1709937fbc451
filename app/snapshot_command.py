"""`paravol snapshot`: one high-quality picture, of a session, a case or a scan."""

import math
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from app.case_exercise import exercise_of
from app.operating_room import Progress, case_room, prepare_room
from app.rendering_service import running_worker
from app.session_info import SEED
from app.session_setup import build_session, path_view
from app.terminal import Stages, print_json
from devices import load_probe_path
from renderers.art.client import Snapshot, SnapshotClient
from renderers.art.job import SnapshotRequest
from renderers.scene import Camera, Projection, Scene, save_png
from scenarios import Scenario, load_scenario
from scenarios.bundle import FrameRecord, SampleRecord, read_session
from scenarios.scenario import Scope

FIELD_DEG = 70.0

Corner = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class SnapshotOptions:
    """Hold what the command line asked for; see `paravol snapshot --help`."""

    session: Path | None
    case: Path | None
    volume: Path | None
    time_s: float
    eye: Corner | None
    target: Corner | None
    classic: bool
    out: Path
    size: int
    ranks: int


def run_snapshot(options: SnapshotOptions, *, as_json: bool) -> int:
    """Render and save; ValueError when the ways to ask are mixed."""
    _check(options)
    with Stages() as stages:
        spool = Path(tempfile.mkdtemp(prefix="paravol-spool-"))
        try:
            client = SnapshotClient(spool, name="paravol snapshot")
            if options.session is not None:
                request = _of_session(client, options, options.session, stages)
            elif options.case is not None:
                request = _of_case(client, options, options.case, stages)
            else:
                assert options.volume is not None
                request = _of_scan(client, options, options.volume, stages)
            snapshot = _render(client, request, options.ranks, stages)
            _save(snapshot, options.out, request)
        finally:
            shutil.rmtree(spool, ignore_errors=True)
    result = snapshot.result
    seconds = result.seconds["total"]
    if as_json:
        print_json({"file": str(options.out), "result": result})
    else:
        print(f"{options.out}: {result.width} x {result.height}, {seconds:.1f} s")
    return 0


def _check(options: SnapshotOptions) -> None:
    """Refuse a mixture before anything slow begins."""
    others = [options.case, options.volume]
    if options.session is not None:
        # a session may need to be told where its case lies now
        others = [options.session, options.volume]
    if sum(one is not None for one in others) != 1:
        raise ValueError(
            "Give either a session folder or --case or --volume, one of them alone."
        )
    if (options.eye is None) != (options.target is None):
        raise ValueError("--eye x y z and --target x y z go together, in mm (LPS).")
    if options.volume is not None and options.eye is None:
        raise ValueError("A scan needs --eye x y z and --target x y z, in mm (LPS).")
    if options.session is not None and (options.eye is not None or options.classic):
        raise ValueError(
            "A session's moment has its own view and look; --eye, --target and "
            "--classic belong to --case."
        )


def _of_session(
    client: SnapshotClient, options: SnapshotOptions, folder: Path, progress: Progress
) -> SnapshotRequest:
    # Imported here: building meshes loads a large library.
    from scenarios.instruments import suction_tube

    info, records, _ = read_session(folder)
    scenario = msgspec.json.decode(info.scenario, type=Scenario)
    if options.case is not None:
        head = msgspec.structs.replace(scenario.head, case=str(options.case))
        scenario = msgspec.structs.replace(scenario, head=head)
    chosen, gain, number = None, None, 0
    for record in records:
        if isinstance(record, SampleRecord):
            if record.time_s > options.time_s and chosen is not None:
                break
            chosen = record
        elif isinstance(record, FrameRecord):
            gain, number = record.gain, record.number
    if chosen is None:
        raise ValueError(f"{folder} holds no sample; nothing was recorded.")
    if scenario.head.case and not Path(scenario.head.case).is_dir():
        raise ValueError(
            f"{folder} was flown through the case {scenario.head.case}, which is not "
            "there; say with --case where it lies now."
        )
    room = prepare_room(scenario, progress)
    if room.surface_sha256 != info.surface_sha256:
        raise ValueError(
            f"{folder} was flown through another head (surface "
            f"{info.surface_sha256[:12]}, now {room.surface_sha256[:12]}); name the "
            "case it was flown through with --case."
        )
    matrix = np.array(info.world_from_device).reshape(4, 4)
    size = (options.size, options.size)
    view = build_session(scenario, room, matrix, size).view(chosen.sample())
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


def _of_case(
    client: SnapshotClient, options: SnapshotOptions, folder: Path, progress: Progress
) -> SnapshotRequest:
    """Look from the eye that was given, or from the exercise's path at the time."""
    if options.eye is None or options.target is None:
        scenario, place = load_scenario(str(exercise_of(folder)))
        room = prepare_room(scenario, progress)
        path = load_probe_path(place / scenario.path)
        size = (options.size, options.size)
        camera = path_view(scenario, room, path, options.time_s, size).camera
    else:
        # no exercise is asked for: a case need not have an entrance to be looked at
        room = case_room(folder, progress)
        lens = Projection.PERSPECTIVE if options.classic else Projection.EQUIDISTANT
        camera = _camera(options.eye, options.target, options.size, lens)
    if options.classic:
        return client.request_classic(room.scene, camera)
    ring = Scope().ring_radius_mm
    return client.request_scope(room.surface, camera, ring_radius_mm=ring, seed=SEED)


def _of_scan(
    client: SnapshotClient, options: SnapshotOptions, file: Path, progress: Progress
) -> SnapshotRequest:
    from anatomy.histogram import find_peaks, transfer_of
    from anatomy.scan import Modality, read_scan

    assert options.eye is not None
    assert options.target is not None
    scan = read_scan(file, progress=progress)
    peaks = find_peaks(scan.volume, bone=scan.modality is Modality.CT)
    scene = Scene(scan.volume, transfer_of(peaks))
    lens = Projection.PERSPECTIVE
    camera = _camera(options.eye, options.target, options.size, lens)
    return client.request_classic(scene, camera)


def _camera(eye: Corner, target: Corner, size: int, lens: Projection) -> Camera:
    return Camera.looking_at(
        eye,
        target,
        extent=math.radians(FIELD_DEG / 2),
        size=(size, size),
        projection=lens,
    )


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
