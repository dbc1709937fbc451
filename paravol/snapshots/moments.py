"""High-quality pictures of chosen moments, and how far the live ones were off."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from paravol.patient import Progress
from paravol.snapshots.comparison import difference, save_comparison
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.rendering_service import running_worker
from paravol.view import Frame
from renderers.scene import AirSurface, save_png
from renderers.scene.lens_state import CLEAN, LensState
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import SnapshotRequest
from scenarios import FrameState, Moment
from scenarios.instruments import placed_tool

BEFORE_S = 0.05
"""A frame so long before its moment shows it: at the end of a path none comes later."""


@dataclass(slots=True)
class SelectedFrame:
    """Keep the first frame of a moment of the flight.

    tissue: as the frame shows it; None where nobody operates.
    """

    moment: Moment
    view: FrameState | None = None
    frame: Frame | None = None
    number: int = 0
    tissue: OperatedHead | None = None

    def wants(self, time_s: float) -> bool:
        """Return whether a frame of this time is kept."""
        return self.frame is None and time_s >= self.moment.time_s - BEFORE_S

    def offer(
        self,
        number: int,
        view: FrameState,
        frame: Frame,
        time_s: float,
        tissue: OperatedHead | None = None,
    ) -> None:
        """Keep the frame if it is wanted."""
        if self.wants(time_s):
            self.view, self.frame, self.tissue = view, frame, tissue
            self.number = number


@dataclass(frozen=True, slots=True)
class SnapshotReport:
    """Report one snapshot and the live picture's distance from it.

    seconds: of the worker, from claim to result. rmse, p99: 8-bit codes.
    """

    name: str
    file: str
    seconds: float
    ranks: int
    rmse: float
    ssim: float
    p99: float


@dataclass(frozen=True, slots=True)
class SnapshotRequestFactory:
    """Make requests for what the endoscope sees of one head in one session."""

    surface: AirSurface
    ring_radius_mm: float
    seed: int
    has_instrument: bool

    def request(
        self,
        client: SnapshotClient,
        view: FrameState,
        *,
        gain: float,
        number: int,
        tissue: OperatedHead | None = None,
        lens: LensState = CLEAN,
        props: Sequence[PlacedMesh] = (),
        progressive: bool = False,
    ) -> SnapshotRequest:
        """Request a view, exposed and with the grain of the live frame of a number.

        tissue: as that frame shows it; None for as it is now. lens: of that frame.
        props: what stands in the scene beside the view's tool.
        """
        tools: list[PlacedMesh] = []
        if self.has_instrument:
            pose = view.world_from_instrument
            tools = placed_tool(view.instrument, pose, view.jaw)
        return client.request_scope(
            self.surface if tissue is None else tissue.surface,
            view.camera,
            ring_radius_mm=self.ring_radius_mm,
            seed=self.seed,
            gain=gain,
            frame_number=number,
            instruments=[*tools, *props],
            progressive=progressive,
        ).through(lens)


def take_snapshots(
    kept: list[SelectedFrame],
    requests: SnapshotRequestFactory,
    *,
    folder: Path,
    ranks: int,
    progress: Progress,
) -> list[SnapshotReport]:
    """Have every kept view drawn by the ray tracer, with the live frame's gain.

    Writes ``NAME.png`` (the snapshot), ``NAME-live.png`` and ``NAME-error.png`` (both
    and their difference). The spool lies beside them, in ``spool``, and keeps the
    requests and the float results.
    """
    stage = "Snapshots"
    progress(stage, 0.0)
    spool = folder / "spool"
    client = SnapshotClient(spool, name="paravol demo")
    wanted = [(k, k.view, k.frame) for k in kept if k.view and k.frame]
    jobs = []
    for selected, view, frame in wanted:
        request = requests.request(
            client,
            view,
            gain=frame.gain,
            number=selected.number,
            tissue=selected.tissue,
            lens=frame.lens,
        )
        jobs.append((client.submit(request), selected, frame))
    reports = []
    with running_worker(spool, ranks=ranks) as worker:
        for index, (job, selected, frame) in enumerate(jobs):

            def show(share: float, done: int = index) -> None:
                progress(stage, (done + share) / len(jobs))

            snapshot = client.wait(job, show, watch=worker.ensure_alive)
            pixels = snapshot.pixels()
            found = difference(frame.pixels, pixels)
            name = selected.moment.name
            file = folder / f"{name.replace(' ', '-')}.png"
            text = {"Title": name, "Software": "PARAVOL", "Job": job}
            save_png(file, pixels, text)
            save_png(file.with_stem(f"{file.stem}-live"), frame.pixels, text)
            error = file.with_stem(f"{file.stem}-error")
            save_comparison(error, frame.pixels, pixels, found, title=name, text=text)
            result = snapshot.result
            reports.append(
                SnapshotReport(
                    name,
                    file.name,
                    result.seconds["total"],
                    result.ranks,
                    found.rmse,
                    found.ssim,
                    found.p99,
                )
            )
    progress(stage, 1.0)
    return reports
