"""`paravol demo`: the recorded flight, end to end, without a screen."""

from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from app.cli.terminal import Stages, print_json, print_table
from app.errors import DeviceLostError
from devices import DeviceError, ProbePath, load_probe_path
from disk import UserError
from paravol.device_log import DeviceLog
from paravol.flight import Shown, Timing, fly
from paravol.inputs.open_arm import demand_port, open_arm
from paravol.inputs.pose_completer import PathChannel
from paravol.inputs.reconnecting_source import LastingPoses
from paravol.output_folder import claimed_folder, remove_old_session
from paravol.patient import OperatingRoom, prepare_room
from paravol.registration.at_start import register_by_touch
from paravol.replay import ReplayReport, replay_session
from paravol.session_info import LIVE_TIER, SEED, describe_session
from paravol.session_setup import build_session, build_view, first_views
from paravol.snapshots.moments import (
    SelectedFrame,
    SnapshotReport,
    SnapshotRequestFactory,
    take_snapshots,
)
from paravol.told_score import score_rows
from paravol.versions import versions
from renderers.scene import Mesh
from scenarios import Scenario, Score, load_scenario
from scenarios.bundle import SessionInfo, SessionRecorder, write_json

LOST_PATIENCE_S = 60.0
"""An arm that was unplugged must be there again by then."""


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """Hold what the command line asked for; see `paravol demo --help`."""

    out: Path
    scenario: str
    device: str | None
    size: int
    ranks: int
    threads: int
    faults: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FlownDemo:
    """Hold what the flight itself left."""

    info: SessionInfo
    timing: Timing
    score: Score
    splats: int
    instrument: Mesh | None
    kept: list[SelectedFrame]


def run_demo(options: DemoOptions, *, as_json: bool) -> int:
    """Run the demonstration; 1 when the replay differs from the flight."""
    if options.size % 2:
        raise UserError(f"--size must be even, for the film; got {options.size}.")
    demand_port(options.device)
    scenario, folder = load_scenario(options.scenario)
    path_file = folder / scenario.path
    path = load_probe_path(path_file)
    with ExitStack() as stack:
        out = stack.enter_context(claimed_folder(options.out))
        stages = stack.enter_context(Stages())
        bundle = out / "flight.paravol"
        remove_old_session(bundle)
        room = prepare_room(scenario, stages)
        flown = _fly(options, scenario, path, path_file, room, bundle, stages)
        snapshots = take_snapshots(
            flown.kept,
            SnapshotRequestFactory(
                room.surface,
                scenario.scope.ring_radius_mm,
                flown.info.seed,
                flown.instrument,
            ),
            folder=out / "snapshots",
            ranks=options.ranks,
            progress=stages,
        )
        report = replay_session(
            bundle,
            threads=options.threads,
            progress=stages,
            video=out / "flight.mp4",
            room=room,
        )
    summary = _summary(scenario, flown, snapshots, report)
    write_json(out / "summary.json", summary)
    if as_json:
        print_json(summary)
    else:
        print_table(f"{scenario.title}: {out}", _rows(summary, flown.score))
    return 0 if report.is_exact else 1


def _fly(
    options: DemoOptions,
    scenario: Scenario,
    path: ProbePath,
    path_file: Path,
    room: OperatingRoom,
    bundle: Path,
    stages: Stages,
) -> FlownDemo:
    kept = [SelectedFrame(moment) for moment in scenario.moments]
    with ExitStack() as stack:
        view = build_view(
            scenario,
            room,
            tier=LIVE_TIER,
            seed=SEED,
            has_instrument=True,
            threads=options.threads,
            progress=stages,
        )
        size = (options.size, options.size)
        view.warm_up(first_views(scenario, room, path, size), stages)
        stages("Opening the arm", 0.0)
        arm = stack.enter_context(
            open_arm(scenario, path_file, device=options.device, faults=options.faults)
        )
        stages("Opening the arm", 1.0)
        poses = LastingPoses(arm, LOST_PATIENCE_S)
        registration = register_by_touch(poses, scenario.fiducial_positions(), stages)
        info = describe_session(
            scenario, room, registration, size=options.size, has_instrument=True
        )
        session = build_session(scenario, room, registration.world_from_device, size)
        recorder = stack.enter_context(SessionRecorder(bundle, info))

        def on_frame(shown: Shown) -> None:
            time_s = shown.sample.time_s
            stages("Flying", time_s / path.duration_s)
            for selected in kept:
                selected.offer(shown.number, shown.view, shown.frame, time_s)

        log = DeviceLog(recorder, session)

        def on_loss(loss: DeviceError) -> None:
            log.lost(loss)
            stages.say(f"{loss} It is waited for {LOST_PATIENCE_S:g} s.")

        poses.on_loss, poses.on_return = on_loss, log.returned
        try:
            timing = fly(
                poses,
                PathChannel(path),
                session,
                view,
                recorder,
                until_s=path.duration_s,
                on_frame=on_frame,
            )
        except (DeviceError, TimeoutError) as error:
            log.lost(error)
            raise DeviceLostError(error, bundle) from error
        score = session.score()
        recorder.close({"score": asdict(score), "timing": timing.figures()})
    splats = view.renderer.splat_count
    return FlownDemo(info, timing, score, splats, view.instrument, kept)


def _summary(
    scenario: Scenario,
    flown: FlownDemo,
    snapshots: list[SnapshotReport],
    report: ReplayReport,
) -> dict[str, Any]:
    return {
        "scenario": scenario.name,
        **flown.timing.figures(),
        "splats": flown.splats,
        "registration_rms_mm": flown.info.registration_rms_mm,
        "snapshots": [asdict(s) for s in snapshots],
        **asdict(flown.score),
        "replay": {
            "exact": report.is_exact,
            "frames": report.frames,
            "differing_frames": len(report.differing_frames),
            "same_score": report.same_score,
        },
        "versions": versions(),
    }


def _rows(summary: dict[str, Any], score: Score) -> list[tuple[str, str]]:
    def spread(values: dict[str, float]) -> str:
        return " / ".join(f"{values[p]:.1f}" for p in ("p50", "p95", "p99"))

    replay = summary["replay"]
    same = "the same" if replay["exact"] else "DIFFERENT"
    rows = [
        ("frames", f"{summary['frames']} ({summary['fps']:.1f} per second)"),
        ("frame time p50 / p95 / p99", f"{spread(summary['frame_ms'])} ms"),
        ("pose age p50 / p95 / p99", f"{spread(summary['pose_age_ms'])} ms"),
        ("splats", f"{summary['splats']:,}"),
        ("registration residual", f"{summary['registration_rms_mm']:.2f} mm rms"),
        *score_rows(score),
        ("replay", f"{replay['frames']} frames and the score {same}"),
    ]
    rows += [
        (
            f"snapshot {s['name']}",
            f"{s['seconds']:.1f} s, {s['ranks']} ranks; live picture off by "
            f"{s['rmse']:.1f} codes RMSE, SSIM {s['ssim']:.3f}",
        )
        for s in summary["snapshots"]
    ]
    return rows
