"""`paravol demo`: the recorded flight, end to end, without a screen."""

from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from app.cli.root import (
    Json,
    Oversubscribe,
    ScenarioName,
    Size,
    Threads,
    UsualRanks,
    rank_count,
    thread_count,
)
from app.cli.terminal import ProgressReporter, print_json, print_table
from paravol.versions import versions
from system import UserError

if TYPE_CHECKING:
    from devices import ProbePath
    from paravol.debrief import WrittenDebrief
    from paravol.flight import flight_events as events
    from paravol.flight.flight import FinishedFlight
    from paravol.sessions.session_replay import ReplayReport
    from paravol.sessions.video import VideoWriter
    from paravol.snapshots.moments import SnapshotReport
    from scenarios import Scenario, Score

FIRST_FLIGHT, FIRST_OPERATION = "first_flight", "first_operation"
"""Scenarios of the demonstration."""

DEBRIEF_PICTURES = 6
"""Of events; the page of `paravol debrief` has more."""

FASTER = 2.0
"""The film shows an operation so many times as fast as it was flown."""

LOST_PATIENCE_S = 60.0
"""An arm that was unplugged must be there again by then."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class DemoOptions:
    """Options of the demonstration, as they were typed.

    Parameters
    ----------
    out
        Folder for everything the demo leaves.
    operation
        Scenario that is flown afterwards; "" for none. After first_flight it is
        first_operation, after any other scenario none.
    device
        Serial port of a real arm instead of the emulated one.
    fault
        Let the emulated arm misbehave, as NAME@SECONDS: garbage, mute or unplug.
    """

    out: Path = Path("out/demo")
    scenario: ScenarioName = FIRST_FLIGHT
    operation: str | None = None
    device: str | None = None
    size: Size = 512
    ranks: UsualRanks = None
    oversubscribe: Oversubscribe = False
    threads: Threads = 0
    fault: tuple[str, ...] = ()

    @property
    def names(self) -> list[tuple[str, str]]:
        """Return the scenarios to fly, each with its recording's name."""
        operation = self.operation
        if operation is None:
            operation = FIRST_OPERATION if self.scenario == FIRST_FLIGHT else ""
        then = [(operation, "operation.paravol")] if operation else []
        return [(self.scenario, "flight.paravol"), *then]


class _Watch:
    """Show how far the flight is; keep the frames of the scenario's moments."""

    def __init__(
        self, scenario: "Scenario", path: "ProbePath", stages: ProgressReporter
    ) -> None:
        from paravol.snapshots.moments import SelectedFrame

        self.kept = [SelectedFrame(moment) for moment in scenario.moments]
        self._duration_s = path.duration_s
        self._stages = stages

    def hear(self, event: "events.FlightEvent") -> None:
        from paravol.flight import flight_events as events
        from paravol.flight.flight_loop import FrameEvent

        match event:
            case events.Progressed(stage, share) | events.Touching(stage, share):
                self._stages(stage, share)
            case FrameEvent(view, frame, sample, number):
                self._stages("Flying", sample.time_s / self._duration_s)
                for selected in self.kept:
                    selected.offer(number, view, frame, sample.time_s, event.tissue)
            case events.Injured(text):
                self._stages.say(f"Injury: {text}.")
            case events.DeviceLost(loss):
                self._stages.say(f"{loss} It is waited for {LOST_PATIENCE_S:g} s.")

    def keeps_tissue(self, time_s: float) -> bool:
        return any(selected.wants(time_s) for selected in self.kept)


@dataclass(frozen=True, slots=True)
class _Flown:
    """What one flight of the demonstration left."""

    scenario: "Scenario"
    flight: "FinishedFlight"
    snapshots: "list[SnapshotReport]"
    report: "ReplayReport"


def demo(*, options: DemoOptions = DemoOptions(), json: Json = False) -> int:
    """Fly a recorded probe path end to end, without a screen.

    An emulated MicroScribe arm touches four fiducials and follows the path through
    the sinus phantom; then it operates: it takes the uncinate process, behind which
    the maxillary ostium lies. The film, the recordings, high-quality snapshots and a
    summary land in one folder.
    """
    # begins before what takes long to import on a new machine
    from paravol.flight.renderer_compiler import RendererCompiler

    with RendererCompiler():
        return _demo(options, json)


def _demo(options: DemoOptions, json: bool) -> int:
    from paravol.debrief import DebriefOrder, write_debrief
    from paravol.exercises.exercise_path import recorded_path
    from paravol.inputs.open_arm import require_port
    from paravol.output_folder import claimed_folder
    from paravol.sessions.session_replay import VIDEO_FPS
    from paravol.sessions.video import VideoWriter
    from paravol.snapshots.rendering_service import startable_ranks
    from scenarios import load_scenario
    from scenarios.bundle import write_json

    if options.size % 2:
        raise UserError(f"--size must be even, for the film; got {options.size}.")
    require_port(options.device)
    names = options.names
    options = replace(
        options,
        ranks=rank_count(
            startable_ranks(options.ranks), oversubscribe=options.oversubscribe
        ),
        threads=thread_count(options.threads),
    )
    for name, _ in names:
        recorded_path(*load_scenario(name))  # refused before anything is flown
    with ExitStack() as stack:
        out = stack.enter_context(claimed_folder(options.out))
        stages = stack.enter_context(ProgressReporter())
        size = options.size, options.size
        film = stack.enter_context(VideoWriter(out / "flight.mp4", size, VIDEO_FPS))
        flown: list[_Flown] = []
        for name, file in names:
            # an operation is shown in half its time
            faster = FASTER if flown else 1.0
            flown.append(_fly(options, name, out / file, film, stages, faster))
        order = DebriefOrder(
            out / names[-1][1],
            out / "debrief.html",
            pictures=DEBRIEF_PICTURES,
            threads=options.threads,
        )
        # of the last flight, which is the operation where there is one
        debrief = write_debrief(order, stages, stages.say)
    summary = _summary(flown[0])
    if len(flown) > 1:
        summary["surgery"] = _summary(flown[1])
    summary["debrief"] = _scored(debrief)
    write_json(out / "summary.json", summary)
    if json:
        print_json(summary)
    else:
        for each in flown:
            rows = _rows(_summary(each), each.flight.score)
            print_table(f"{each.scenario.title}: {out}", rows)
        told = "no score" if debrief.percent is None else f"{debrief.percent:.0f} %"
        print(f"{debrief.out}: the last flight talked over; {told}.")
    return 0 if all(each.report.is_exact for each in flown) else 1


def _fly(
    options: DemoOptions,
    name: str,
    bundle: Path,
    film: "VideoWriter",
    stages: ProgressReporter,
    faster: float,
) -> _Flown:
    """Fly a scenario, draw its moments, replay it into the film."""
    from paravol.exercises.exercise_path import recorded_path
    from paravol.flight.flight import Flight, FlightOrder
    from paravol.inputs.arm import ArmInput
    from paravol.output_folder import remove_old_session
    from paravol.sessions.session_replay import replay_session
    from paravol.snapshots.moments import SnapshotRequestFactory, take_snapshots
    from scenarios import load_scenario

    scenario, folder = load_scenario(name)
    path, path_file = recorded_path(scenario, folder), folder / scenario.path
    arm = ArmInput(
        scenario,
        path,
        path_file,
        options.device,
        follows_path=True,
        faults=options.fault,
    )
    remove_old_session(bundle)
    watch = _Watch(scenario, path, stages)
    order = FlightOrder(
        scenario,
        path,
        arm,
        options.size,
        options.threads,
        bundle,
        patience_s=LOST_PATIENCE_S,
    )
    flown = Flight(order, watch.hear, watch.keeps_tissue).run()
    assert flown is not None  # only the path ends it
    snapshots = take_snapshots(
        watch.kept,
        SnapshotRequestFactory(
            flown.patient.surface,
            scenario.scope.ring_radius_mm,
            flown.info.seed,
            flown.view.has_instrument,
        ),
        folder=bundle.parent / "snapshots",
        ranks=options.ranks or 1,
        progress=stages,
    )
    report = replay_session(
        bundle,
        threads=options.threads,
        progress=stages,
        video=film,
        faster=faster,
    )
    return _Flown(scenario, flown, snapshots, report)


def _scored(debrief: "WrittenDebrief") -> dict[str, Any]:
    return {
        "file": debrief.out.name,
        "session": debrief.session,
        "rubric": debrief.rubric,
        "percent": debrief.percent,
        "verdict": debrief.verdict,
    }


def _summary(flown: _Flown) -> dict[str, Any]:
    flight, report = flown.flight, flown.report
    return {
        "scenario": flown.scenario.name,
        **flight.timing.figures(),
        "splats": flight.view.renderer.splat_count,
        "registration_rms_mm": flight.info.registration_rms_mm,
        "snapshots": [asdict(s) for s in flown.snapshots],
        **asdict(flight.score),
        "replay": {
            "exact": report.is_exact,
            "frames": report.frames,
            "differing_frames": len(report.differing_frames),
            "same_score": report.same_score,
        },
        "versions": versions(),
    }


def _rows(summary: dict[str, Any], score: "Score") -> list[tuple[str, str]]:
    from paravol.scoring.score_table import score_rows

    def spread(values: dict[str, float]) -> str:
        return " / ".join(f"{values[p]:.1f}" for p in ("p50", "p95", "p99"))

    parts = [f"{name} {share:.0%}" for name, share in summary["shares"].items()]
    shares = f"{', '.join(parts)}; {summary['cores']:.1f} cores"
    replay = summary["replay"]
    same = "the same" if replay["exact"] else "DIFFERENT"
    rows = [
        ("frames", f"{summary['frames']} ({summary['fps']:.1f} per second)"),
        ("frame time p50 / p95 / p99", f"{spread(summary['frame_ms'])} ms"),
        ("pose age p50 / p95 / p99", f"{spread(summary['pose_age_ms'])} ms"),
        ("time spent on each stage", shares),
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
