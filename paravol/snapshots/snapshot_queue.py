"""Moments that a trainee keeps are drawn at high quality while the flight goes on."""

import os
import queue
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.port import Closing
from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.rendering_service import Worker, running_worker
from paravol.snapshots.spool_folder import own_spool
from renderers.scene import rmse_codes, save_png
from renderers.scene.lens_state import CLEAN, LensState
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.growing import GrowingPicture
from scenarios import FrameState
from system import UserError

PATIENCE_S = 10.0
"""A worker that is told to end has so long before it is ended."""


@dataclass(frozen=True, slots=True)
class SelectedMoment:
    """Name a frame of the flight that is wanted at high quality.

    tissue: as the frame shows it; None where nobody operates. lens: of the frame.
    live: the frame's picture, ``(h, w, 3)`` uint8 sRGB, to compare; None not to.
    props: what stands in the scene beside the view's tool. name: of the picture's file,
    "" for one by its time.
    """

    time_s: float
    view: FrameState
    gain: float
    number: int
    tissue: OperatedHead | None = None
    lens: LensState = CLEAN
    live: NDArray[np.uint8] | None = None
    props: tuple[PlacedMesh, ...] = ()
    name: str = ""


@dataclass(frozen=True, slots=True)
class MomentPicture:
    """Show a moment's picture as it is now; pixels ``(h, w, 3)`` uint8 sRGB.

    done: the share that is finished; None where nothing more will come. `message` says
    then where the picture is, or why there is none, and `rmse` how far the live picture
    was from it, in 8-bit codes; None where nobody compared.
    """

    time_s: float
    pixels: NDArray[np.uint8] | None
    done: float | None
    message: str = ""
    rmse: float | None = None


class _ClosedError(Exception):
    """The queue was closed: nobody waits for the picture."""


@dataclass(slots=True)
class _Showing:
    """Pass a job's growing picture on, whenever it has grown or come further."""

    moment: SelectedMoment
    growing: GrowingPicture
    show: Callable[[MomentPicture], None]
    done: float = 0.0
    is_empty: bool = True

    def look(self) -> None:
        if self.growing.update():
            self.is_empty = False
            self.tell(self.done)

    def tell(self, done: float) -> None:
        self.done = done
        pixels = None if self.is_empty else self.growing.pixels.copy()
        self.show(MomentPicture(self.moment.time_s, pixels, done))


Serving = Callable[[Path], AbstractContextManager[Worker]]
"""Serve a spool folder while the context lasts."""

NICE_WORKER = partial(running_worker, ranks=1, niceness=19)


class SnapshotQueue(Closing):
    """Have moments drawn, one after the other, by a worker of low priority.

    The worker starts with the first moment. The live picture comes first: the worker
    only gets what is left of the processor.
    """

    def __init__(
        self,
        requests: SnapshotRequestFactory,
        folder: Path,
        show: Callable[[MomentPicture], None],
        serving: Serving = NICE_WORKER,
    ) -> None:
        """Start the queue's thread.

        folder: for the finished pictures. show: told of every change, from the queue's
        own thread.
        """
        self._requests = requests
        self._folder = folder
        self._show = show
        self._serving = serving
        self._orders: queue.SimpleQueue[SelectedMoment | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="snapshots", daemon=True)
        self._thread.start()

    def draw(self, moment: SelectedMoment) -> None:
        """Have a moment drawn after those before it."""
        self._orders.put(moment)

    def close(self) -> None:
        """Give up what is not finished, and end the worker."""
        self._closed.set()
        self._orders.put(None)
        self._thread.join(PATIENCE_S)

    def _run(self) -> None:
        moment = self._orders.get()
        if moment is None:
            return
        try:
            with own_spool() as spool:
                client = SnapshotClient(spool, name="paravol train")
                with self._serving(spool) as worker:
                    while moment is not None and not self._closed.is_set():
                        self._draw(client, worker, moment)
                        moment = self._orders.get()
        except OSError as error:
            if moment is not None:
                self._show(MomentPicture(moment.time_s, None, None, str(error)))

    def _draw(
        self, client: SnapshotClient, worker: Worker, moment: SelectedMoment
    ) -> None:
        request = self._requests.request(
            client,
            moment.view,
            gain=moment.gain,
            number=moment.number,
            tissue=moment.tissue,
            lens=moment.lens,
            props=moment.props,
            progressive=True,
        )
        size = request.image.width, request.image.height
        growing = GrowingPicture(client.spool, request.id, *size)
        showing = _Showing(moment, growing, self._show)
        job = client.submit(request)

        def watch() -> None:
            worker.ensure_alive()
            showing.look()
            if self._closed.is_set():
                client.cancel(job)
                raise _ClosedError

        try:
            snapshot = client.wait(job, showing.tell, watch=watch)
            pixels = snapshot.pixels()
            name = moment.name or f"moment-{moment.time_s:.2f}"
            file = self._folder / f"{name}.png"
            text = {"Title": f"{moment.time_s:.2f} s", "Software": "PARAVOL"}
            save_png(file, pixels, text)
            live, rmse = moment.live, None
            if live is not None and live.shape == pixels.shape:
                rmse = rmse_codes(live, pixels)
            told = MomentPicture(moment.time_s, pixels, None, os.fspath(file), rmse)
            self._show(told)
        except _ClosedError:
            return
        except (OSError, RuntimeError, UserError) as error:
            # The flight is worth more than a picture of it.
            self._show(MomentPicture(moment.time_s, None, None, str(error)))
