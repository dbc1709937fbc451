"""The command line: names, options, help. The work is done elsewhere.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from app.cli import (
    arm_commands,
    bench_commands,
    case_commands,
    picture_commands,
    progress_commands,
    scenario_commands,
    session_commands,
    teaching_commands,
)
from app.cli.emulator_options import NOTHING_TYPED, EmulatorOptions
from app.cli.replay_options import NOTHING_TYPED as REPLAYED
from app.cli.replay_options import ReplayOptions
from app.cli.root import (
    DEVICES,
    FLATTENED,
    FLY,
    MACHINE,
    PICTURES,
    SESSIONS,
    Flag,
    Json,
    Oversubscribe,
    ScenarioName,
    Size,
    Threads,
    UsualRanks,
    app,
    rank_count,
    thread_count,
)
from app.cli.train_options import NOTHING_TYPED as AS_USUAL
from app.cli.train_options import TrainOptions
from disk import UserError
from paravol.snapshots.worker_options import WorkerOptions

ONE_RANK = WorkerOptions()

__all__ = [
    "app",
    "arm_commands",
    "bench_commands",
    "case_commands",
    "picture_commands",
    "progress_commands",
    "scenario_commands",
    "session_commands",
    "teaching_commands",
]


FIRST_FLIGHT, FIRST_OPERATION = "first_flight", "first_operation"
"""Scenarios of the demonstration."""


@app.command(group=FLY)
def demo(
    *,
    out: Path = Path("out/demo"),
    scenario: ScenarioName = FIRST_FLIGHT,
    operation: str | None = None,
    device: str | None = None,
    size: Size = 512,
    ranks: UsualRanks = None,
    oversubscribe: Oversubscribe = False,
    threads: Threads = 0,
    fault: tuple[str, ...] = (),
    json: Json = False,
) -> int:
    """Fly a recorded probe path end to end, without a screen.

    An emulated MicroScribe arm touches four fiducials and follows the path through
    the sinus phantom; then it operates: it takes the uncinate process and widens the
    maxillary ostium. The film, the recordings, high-quality snapshots and a summary
    land in one folder.

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
    from app.cli.demo import DemoOptions, run_demo
    from paravol.snapshots.rendering_service import startable_ranks

    if operation is None:
        operation = FIRST_OPERATION if scenario == FIRST_FLIGHT else ""
    options = DemoOptions(
        out=out,
        scenario=scenario,
        operation=operation,
        device=device,
        size=size,
        ranks=rank_count(startable_ranks(ranks), oversubscribe=oversubscribe),
        threads=thread_count(threads),
        faults=fault,
    )
    return run_demo(options, as_json=json)


@app.command(group=SESSIONS)
def replay(
    session: Path, *, options: ReplayOptions = REPLAYED, json: Json = False
) -> int:
    """Run a recorded session again, without the device; film it, or two together.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    from app.cli.replay_command import run_at, run_film, run_replay, run_view_at

    options.demand_sense()
    options = replace(options, threads=thread_count(options.threads))
    if options.window:
        from app.cli.replay_window import run_replay_window

        return run_replay_window(session, options)
    if options.at is not None:
        run_at(session, options.at, options, as_json=json)
        return 0
    if options.view_at is not None and options.out is not None:
        run_view_at(
            session, options.view_at, options.out, case=options.case, quietly=json
        )
        if not options.check and options.video is None:
            return 0
    if options.is_own_film:
        run_film(session, options, as_json=json)
        return 0
    return run_replay(
        session,
        check=options.check,
        video=options.video,
        threads=options.threads,
        as_json=json,
    )


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class MetricsOptions:
    """Options of metrics, as they were typed.

    Parameters
    ----------
    csv
        Write a table that begins with PerkTutor's columns.
    json_file
        Write all values, with the seconds of the session that each came from.
    only
        Compute the metrics of this name; may be given several times.
    settings
        TOML file of thresholds and filters, and of what was to be removed.
    arm
        Profile of the arm that was used, such as dx: noise from its counts. Without
        it the noise is estimated from the record.
    case
        Where the case that was flown through lies now.
    expert
        Another session of the same head, whose path, and the cavity it cut, are
        compared with.
    motion_only
        Leave the head out: no contact, hazards, targets or removal, but at once.
    """

    csv: Path | None = None
    json_file: Path | None = None
    only: tuple[str, ...] = ()
    settings: Path | None = None
    arm: str = ""
    case: Path | None = None
    expert: Path | None = None
    motion_only: Flag = False


@app.command(group=SESSIONS)
def metrics(
    session: Path, *, options: MetricsOptions = MetricsOptions(), json: Json = False
) -> int:
    """Measure how a recorded session was flown: path, smoothness, view, contact.

    Every value comes with the share of the device's noise in it, 1 sigma.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    from app.cli.metrics_command import run_metrics

    return run_metrics(session, options, as_json=json)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class CoverageOptions:
    """Options of coverage, as they were typed.

    Parameters
    ----------
    out
        Write the mucosa as a surface (.vtp, LPS) with the seconds each part was seen.
    picture
        Write a picture (.png) of the opened nose, coloured likewise.
    json_file
        Write all values.
    case
        Where the case that was flown through lies now.
    """

    out: Path | None = None
    picture: Path | None = None
    json_file: Path | None = None
    case: Path | None = None


@app.command(group=SESSIONS)
def coverage(
    session: Path, *, options: CoverageOptions = CoverageOptions(), json: Json = False
) -> int:
    """Tell which mucosa and landmarks a recorded session really saw, site by site.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    from app.cli.coverage_command import run_coverage

    return run_coverage(session, options, as_json=json)


@app.command(group=SESSIONS)
def debrief(
    session: Path,
    *,
    out: Path | None = None,
    compare: Path | None = None,
    quality: Literal["fast", "fine"] = "fast",
    no_pictures: Flag = False,
    pictures: int = 16,
    rubric: str = "",
    case: Path | None = None,
    threads: Threads = 0,
    json: Json = False,
) -> int:
    """Write what a recorded session is talked over with: one HTML file, offline.

    Timeline, hazards, path, wounds, tissue taken, metrics, comparison, and what to
    practise next. A minute of flight takes about a minute.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    out
        The HTML file; NAME-debrief.html beside the session when left out.
    compare
        Another session of the same head, such as an earlier one or an expert's. The
        path that comes with the scenario when left out.
    quality
        Who draws the pictures: the live renderer, or the ray tracer, which takes a few
        seconds for each.
    no_pictures
        Draw none: fewer seconds, and a file of some 200 kB.
    pictures
        Events that get a picture, at most.
    rubric
        Name of a rubric or a TOML file: points, pass mark, margins. The one for
        operating, or for endoscopy where nothing was cut, when left out.
    case
        Where the case that was flown through lies now.
    """
    from app.cli.terminal import Stages, print_json
    from disk import demand_place
    from paravol.debrief import DebriefOrder, write_debrief
    from paravol.debrief.pictures import Quality

    name = session.name.removesuffix(".paravol")
    order = DebriefOrder(
        session,
        out or session.with_name(f"{name}-debrief.html"),
        compare=compare,
        quality=None if no_pictures else Quality(quality),
        pictures=pictures,
        threads=thread_count(threads),
        case=case,
        rubric=rubric,
    )
    demand_place(order.out)
    with Stages() as stages:
        written = write_debrief(order, stages, stages.say)
    if json:
        print_json({**asdict(written), "out": str(written.out)})
    else:
        print(
            f"{written.out}: {written.events} events, {written.pictures} pictures, "
            f"{written.size_bytes / 1e6:.1f} MB in one file; open it in any browser."
        )
    return 0


@app.command(group=FLY)
def train(*, options: TrainOptions = AS_USUAL) -> int:
    """Open the trainee's window: endoscope, overview, frame rate."""
    from app.cli.train import run_train

    threads = thread_count(options.threads)
    return run_train(replace(options, threads=threads))


@app.command(group=PICTURES)
def worker(
    *,
    spool: Path,
    create: Flag = False,
    options: Annotated[WorkerOptions, FLATTENED] = ONE_RANK,
    oversubscribe: Oversubscribe = False,
) -> int:
    """Serve snapshot requests from a spool folder.

    Several workers may serve one folder, on several machines if they share its disk.
    One that dies loses no request: another takes its job over.

    Parameters
    ----------
    spool
        Folder shared with the program that asks for snapshots.
    create
        Make the folder if it is missing.
    """
    from paravol.snapshots.rendering_service import run_worker_command
    from paravol.snapshots.spool_folder import demand_spool

    demand_spool(spool, create=create)
    ranks = rank_count(options.ranks, oversubscribe=oversubscribe)
    return run_worker_command(spool, replace(options, ranks=ranks))


@app.command(group=DEVICES)
def emulator(*, options: EmulatorOptions = NOTHING_TYPED) -> int:
    """Emulate a MicroScribe behind a pseudo-terminal and print the port's name.

    Any program that talks to the arm over a serial port can open it:

        paravol emulator
        paravol emulator --profile dx --probe-path hand.path.json
        paravol emulator --motion orbit --listen 4455
        paravol emulator --fault f8_dropped_byte@12.5 --fault f30
        paravol emulator --fault flipped_bit@p:0.01 --seed 7
        paravol emulator --fault unplug@packet:200 --transcript line.txt
        paravol emulator --link arm --do unplug@5+2 --do right_pedal@3+.5

    A fault is NAME[=VARIANT][@WHEN]: SECONDS since the first packet (0, or nothing,
    means from power-on), SECONDS+DURATION, packet:N or p:PROBABILITY for each packet.
    """
    from app.cli.emulator_command import run_emulator

    return run_emulator(options)


@app.command(group=MACHINE)
def tools(*, json: Json = False) -> int:
    """List the surgeon's instruments, with their sizes and forces."""
    from app.cli.tools_command import run_tools

    return run_tools(as_json=json)


@app.command(group=MACHINE)
def doctor(
    *, device: str | None = None, accept_constants: bool = False, json: Json = False
) -> int:
    """Say what this machine can do and what is missing, or whether an arm is well.

    Parameters
    ----------
    device
        Look at the MicroScribe on this serial port instead, such as /dev/ttyUSB0 or
        a name under /dev/serial/by-id, while its joints are moved: constants, rate,
        encoders, line, clock, pedals.
    accept_constants
        Keep the arm's constants though they changed or are unusual.
    """
    if device is not None:
        from app.cli.doctor import run_arm_check

        return run_arm_check(device, as_json=json, accept_constants=accept_constants)
    if accept_constants:
        raise UserError("--accept-constants needs --device with the arm's port.")
    from app.cli.doctor import run_doctor

    return run_doctor(as_json=json)


@app.command(name="desktop-entry", group=MACHINE)
def desktop_entry(*, remove: Flag = False) -> int:
    """Put PARAVOL among the desktop's applications, with an icon.

    Parameters
    ----------
    remove
        Remove it from there.
    """
    from app.cli.desktop_entry import run_desktop_entry

    return run_desktop_entry(removes=remove)
