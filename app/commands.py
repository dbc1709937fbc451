"""The command line: names, options, help. The work is done elsewhere.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

app = App(
    name="paravol",
    help="Endoscopic sinus surgery trainer: fly, replay, snapshot, measure.",
    help_epilogue="Start with: paravol demo",
    # Ctrl-C is told by main(), which also sets the exit status.
    suppress_keyboard_interrupt=False,
)

Threads = Annotated[
    int, Parameter(help="Rendering threads; 0 takes what the machine has.")
]
Json = Annotated[bool, Parameter(negative="", help="Print the result as JSON.")]


@app.command
def demo(
    *,
    out: Path = Path("out/demo"),
    scenario: str = "first_flight",
    device: str | None = None,
    size: int = 512,
    ranks: int = 2,
    threads: Threads = 0,
    fault: tuple[str, ...] = (),
    json: Json = False,
) -> int:
    """Fly a recorded probe path end to end, without a screen.

    An emulated MicroScribe arm touches four fiducials and follows the path through
    the sinus phantom; the pictures, the recording, three high-quality snapshots and
    a summary land in one folder.

    Parameters
    ----------
    out
        Folder for everything the demo leaves.
    scenario
        Name of a bundled scenario, or a .toml file of your own.
    device
        Serial port of a real arm instead of the emulated one.
    size
        Width and height of the picture in pixels.
    ranks
        MPI processes for the snapshots; 1 renders without MPI.
    fault
        Let the emulated arm misbehave, as NAME@SECONDS: garbage, mute or unplug.
    """
    from app.demo import DemoOptions, run_demo

    options = DemoOptions(
        out=out,
        scenario=scenario,
        device=device,
        size=size,
        ranks=ranks,
        threads=_threads(threads),
        faults=fault,
    )
    return run_demo(options, as_json=json)


@app.command
def replay(
    session: Path,
    *,
    check: bool = False,
    video: Path | None = None,
    threads: Threads = 0,
    json: Json = False,
) -> int:
    """Run a recorded session again, without the device.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    check
        End with status 1 unless every frame and every figure comes out the same.
    video
        Write the frames as an MP4 film.
    """
    from app.report import run_replay

    return run_replay(
        session, check=check, video=video, threads=_threads(threads), as_json=json
    )


@app.command
def train(
    *,
    scenario: str = "first_flight",
    device: str | None = None,
    size: int = 512,
    threads: Threads = 0,
    record: Path | None = None,
    seconds: float | None = None,
    screenshot: Path | None = None,
) -> int:
    """Open the trainee's window: endoscope, overview, frame rate.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0. Without it the emulated
        arm flies the scenario's path.
    record
        Record the session into this folder, NAME.paravol.
    seconds
        Close the window by itself after this time.
    screenshot
        Save a picture of the window when it closes.
    """
    from app.train import run_train

    return run_train(
        scenario=scenario,
        device=device,
        size=size,
        threads=_threads(threads),
        record=record,
        seconds=seconds,
        screenshot=screenshot,
    )


@app.command
def snapshot(
    session: Path | None = None,
    *,
    time: float = 0.0,
    volume: Path | None = None,
    eye: tuple[float, float, float] | None = None,
    target: tuple[float, float, float] | None = None,
    out: Path = Path("out/snapshot.png"),
    size: int = 512,
    ranks: int = 1,
    json: Json = False,
) -> int:
    """Render one high-quality picture: of a session's moment or of a scan.

    Parameters
    ----------
    session
        A recorded session; its view at --time is rendered.
    time
        Seconds into the session.
    volume
        A CT scan (NRRD, NIfTI, MetaImage) instead of a session, with --eye and
        --target.
    eye
        Where to look from: x y z in millimetres, patient LPS.
    target
        Where to look at.
    out
        PNG file to write.
    ranks
        MPI processes; 1 renders without MPI.
    """
    from app.snapshot_command import run_snapshot

    return run_snapshot(
        session=session,
        time_s=time,
        volume=volume,
        eye=eye,
        target=target,
        out=out,
        size=size,
        ranks=ranks,
        as_json=json,
    )


@app.command
def worker(
    *,
    spool: Path,
    ranks: int = 1,
    once: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Serve snapshot requests from a spool folder.

    Parameters
    ----------
    spool
        Folder shared with the program that asks for snapshots.
    ranks
        MPI processes; 1 renders without MPI.
    once
        Stop when the queue is empty.
    """
    from app.rendering_service import run_worker_command

    return run_worker_command(spool, ranks=ranks, once=once)


@app.command
def phantom(
    *,
    out: Path,
    seed: int = 1,
    average: bool = False,
    variant: tuple[str, ...] = (),
    without: tuple[str, ...] = (),
    lund_mackay: tuple[str, ...] = (),
    spacing: float = 0.5,
    noise: float = 12.0,
    mr: bool = False,
    json: Json = False,
) -> int:
    """Write a virtual patient as a case folder that 3D Slicer opens.

    Parameters
    ----------
    out
        Folder for ct.nrrd, labels.seg.nrrd, landmarks.mrk.json and case.json.
    seed
        Draws a patient: sizes, septum, skull base, cells and variants.
    average
        Take the average adult instead; the seed then draws the cells alone.
    variant
        Add a variant, such as onodi:left, haller or keros-3; may be repeated.
    without
        Remove a variant, such as agger-nasi:right; may be repeated.
    lund_mackay
        Add disease, such as maxillary:left=2,ostiomeatal:left=2 or polyps=3.
    spacing
        Voxel edge in millimetres.
    noise
        Standard deviation of the CT's noise in HU: 12 is a soft kernel, 50 a bone one.
    mr
        Write t1.nrrd and t2.nrrd too.
    """
    from app.phantom_command import run_phantom

    return run_phantom(
        out=out,
        seed=seed,
        spacing_mm=spacing,
        as_json=json,
        average=average,
        variants=variant,
        without=without,
        lund_mackay=lund_mackay,
        noise_hu=noise,
        resonance=mr,
    )


@app.command
def emulator(
    *,
    path: Path | None = None,
    seed: int = 0,
    fault: tuple[str, ...] = (),
) -> int:
    """Emulate a MicroScribe behind a pseudo-terminal and print the port's name.

    Parameters
    ----------
    path
        Recorded probe path to follow; the bundled one when left out.
    seed
        Where the arm stands beside the patient.
    fault
        Misbehave, as NAME@SECONDS: garbage, mute or unplug.
    """
    from app.emulator_command import run_emulator

    return run_emulator(path=path, seed=seed, faults=fault)


@app.command
def bench(
    *,
    suite: tuple[str, ...] = (),
    quick: Annotated[bool, Parameter(negative="")] = False,
    out: Path = Path("out/bench"),
    fresh: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> int:
    """Measure run time against error, peers in the same run.

    Parameters
    ----------
    suite
        Suites to run; all of them when left out.
    quick
        Small sizes: about three minutes on two cores.
    out
        Folder for results.json and the pictures; an interrupted run goes on there.
    fresh
        Start over instead of going on.
    """
    from benchmarks.runner import run_bench

    return run_bench(suites=suite, quick=quick, out=out, fresh=fresh, as_json=json)


@app.command
def doctor(*, json: Json = False) -> int:
    """Say what this machine can do and what is missing."""
    from app.doctor import run_doctor

    return run_doctor(as_json=json)


def _threads(asked: int) -> int:
    import os

    if asked < 0:
        raise ValueError(f"--threads must not be negative, got {asked}")
    return asked or len(os.sched_getaffinity(0))
