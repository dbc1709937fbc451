"""Frames drawn by real ranks: starts them with mpiexec, and is what they run.

`python -m mpi4py -m benchmarks.ranks.mpi_frames FOLDER` is one rank. FOLDER holds
`job.json` and the volumes that its requests name; each rank leaves `rank-<n>.json`
there.
"""

import hashlib
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from benchmarks.machine import ROOT
from renderers.art.crew import ALONE, MachineCrew
from renderers.art.march import FrameRays, March
from renderers.art.ranks.picture_room import PictureRoom
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import MarchNode, make_node
from renderers.art.ranks.rank import Rank
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Gather, deal_regions
from renderers.scene import Camera
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.launcher import Launcher, find_launcher
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.team import mode_of, traced_camera

if TYPE_CHECKING:
    from renderers.art.ranks.mpi import MpiTransport

LIMIT_S = 300.0
"""Longest run; what takes longer hangs."""


class RankJob(msgspec.Struct, frozen=True, kw_only=True):
    """Set what ranks draw: a frame for each request, all of one scene.

    rounds: how often the whole series is drawn, with new nodes each time.
    """

    requests: tuple[SnapshotRequest, ...] = ()
    dataflow: str = Dataflow.MIGRATING.value
    cache_cells: int | None = None
    from_file: bool = False
    cell_side: int = 8
    region_px: int | None = None
    rounds: int = 1


class FrameReport(msgspec.Struct, frozen=True, kw_only=True):
    """What a frame cost one rank. digest: of the picture, rank 0 only."""

    wall_s: float
    tally: dict[str, int]
    sends: int
    digest: str = ""


class RankReport(msgspec.Struct, frozen=True, kw_only=True):
    """What one rank did. rounds: frames by round.

    made_s: time of each round's preparation, the volume's loading included.
    peak_bytes: most memory resident, mapped files included. own_bytes: most that is
    this process's alone, looked at after each frame; peak_own_bytes: looked at every
    10 ms. shared_bytes: that it has in common with other ranks, at the end. distances:
    as the transport has them.
    """

    rank: int
    occupied: int
    slots: int
    made_s: tuple[float, ...]
    rounds: tuple[tuple[FrameReport, ...], ...]
    peak_bytes: int
    own_bytes: int
    peak_own_bytes: int = 0
    shared_bytes: int = 0
    distances: tuple[int, ...] = ()


def run_ranks(
    ranks: int,
    job: RankJob,
    folder: Path,
    *before: str,
    options: Sequence[str] = (),
    launcher: Launcher | None = None,
) -> list[RankReport]:
    """Draw a job with so many processes; RuntimeError says what they said if it fails.

    folder: has the data in `data`. before: words before mpiexec. options: after it.
    launcher: None for the one that `find_launcher` finds.
    """
    (folder / "job.json").write_bytes(msgspec.json.encode(job))
    for old in folder.glob("rank-*"):
        old.unlink()
    launcher = launcher or find_launcher()
    if launcher is None:
        raise RuntimeError("there is no mpiexec; install the extra `mpi`")
    words = [*before, *launcher.command(ranks, *options), sys.executable]
    words += ["-m", "mpi4py", "-m", "benchmarks.ranks.mpi_frames", str(folder)]
    done = subprocess.run(
        words,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
        cwd=ROOT,
    )
    if done.returncode:
        raise RuntimeError(f"the ranks ended with {done.returncode}: {done.stderr}")
    return [
        msgspec.json.decode((folder / f"rank-{n}.json").read_bytes(), type=RankReport)
        for n in range(ranks)
    ]


def main(words: Sequence[str]) -> int:
    """Be one rank."""
    from renderers.art.ranks.mpi import MpiTransport

    folder = Path(words[0])
    job = msgspec.json.decode((folder / "job.json").read_bytes(), type=RankJob)
    transport = MpiTransport(folder=folder)
    memory = _Memory()
    memory.start()
    rounds: list[tuple[FrameReport, ...]] = []
    own = occupied = slots = 0
    made_s: list[float] = []
    is_shared = Dataflow(job.dataflow) is Dataflow.SHARED
    crew = MachineCrew(transport) if is_shared else ALONE
    room = PictureRoom(crew) if is_shared else None
    rank = Rank(transport, packets=4 if is_shared else 1)
    frame = 0
    for _ in range(job.rounds):
        transport.meet()
        began = time.perf_counter()
        first = job.requests[0]
        scene = load_scene(DataStore(folder / "data"), first)
        march, node, work = make_node(
            scene,
            mode_of(first),
            first.to_quality(),
            policy=CellPolicy(job.cache_cells, Dataflow(job.dataflow), job.from_file),
            rank=transport.rank,
            ranks=transport.ranks,
            distances=transport.distances,
            cell_side=job.cell_side,
            crew=crew,
        )
        made_s.append(time.perf_counter() - began)
        occupied, slots = work.occupied, len(work.bricks.view.stamp) - 1
        reports = []
        for request in job.requests:
            before, sends = node.tally(), transport.sends
            transport.meet()
            began = time.perf_counter()
            frame += 1
            camera = traced_camera(request)
            gather = draw_frame(
                rank,
                transport,
                (march, node, work),
                camera,
                frame,
                job.region_px,
                room,
            )
            wall_s = time.perf_counter() - began
            after = node.tally()
            reports.append(
                FrameReport(
                    wall_s=wall_s,
                    tally={name: after[name] - before[name] for name in after},
                    sends=transport.sends - sends,
                    digest=""
                    if transport.rank or gather is None
                    else digest_of(gather),
                )
            )
            own = max(own, own_bytes())
        rounds.append(tuple(reports))
    report = RankReport(
        rank=transport.rank,
        occupied=occupied,
        slots=slots,
        made_s=tuple(made_s),
        rounds=tuple(rounds),
        peak_bytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        own_bytes=own,
        shared_bytes=own_bytes("RssShmem"),
        peak_own_bytes=memory.stop(),
        distances=tuple(transport.distances(transport.rank)),
    )
    path = folder / f"rank-{transport.rank}.json"
    path.write_bytes(msgspec.json.encode(report))
    transport.close()
    return 0


def draw_frame(
    rank: Rank,
    here: "MpiTransport",
    made: tuple[March, MarchNode, MarchWork],
    camera: Camera,
    frame: int,
    region_px: int | None,
    room: PictureRoom | None = None,
) -> Gather | None:
    """Draw a frame with what is kept; rank 0 gets the picture, others None.

    All ranks call it in the same order. region_px: see `deal_regions`. room: in which
    ranks that share memory gather.
    """
    march, node, work = made
    size = camera.width, camera.height
    rays = FrameRays.of(camera)
    regions = deal_regions(*size, here.rank, here.ranks, region_px)
    is_first = here.rank == 0
    gather = Gather(*size) if is_first or room is not None else None
    if gather is not None and room is not None:
        if not room.fits(gather):
            room.make(gather)
        if is_first:
            room.begin(gather)
        # stands for the order to draw
        here.meet()
        room.enter(gather)
    work.deliver(gather)
    turns, packets = None, []
    if room is not None and march.drawer is not None and not node.stamps:
        turns = room.turns(here.rank, march.drawer, work, rays)
    else:
        packets = [march.start(region, rays) for region in regions]
    rank.begin(frame, node, packets, gather if is_first else None, turns)
    while rank.is_drawing:
        if is_first and rank.is_complete:
            rank.end()
            if room is not None and gather is not None:
                room.leave(gather)
        elif not rank.step():
            rank.rest()
    return gather


class _Memory(threading.Thread):
    """Look at this process's own memory now and then."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._most = 0
        self._ended = threading.Event()

    def run(self) -> None:
        """Look until stopped."""
        while not self._ended.wait(0.01):
            self._most = max(self._most, own_bytes())

    def stop(self) -> int:
        """End; get the most that was seen."""
        self._ended.set()
        self.join()
        return self._most


def digest_of(gather: Gather) -> str:
    """Return the SHA-256 of a picture's numbers."""
    return hashlib.sha256(gather.value.tobytes() + gather.depth.tobytes()).hexdigest()


def own_bytes(kind: str = "RssAnon") -> int:
    """Return the memory that is this process's alone, or of a kind of Linux's."""
    for line in Path("/proc/self/status").read_text().splitlines():
        name, _, value = line.partition(":")
        if name == kind:
            return int(value.split()[0]) * 1024
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
