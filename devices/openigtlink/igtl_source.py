"""Poses from an OpenIGTLink peer, such as a tracker's server or 3D Slicer."""

import math
import socket
import threading
import time

from devices.openigtlink.messages import ToolTransform, TransformReader
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from devices.pose_queue import PoseQueue
from devices.source import QueuedSource

PATIENCE_S = 5.0
"""Time for the first connection; a peer on the same network answers in milliseconds."""

RETRY_S = 0.2
SLICE_S = 0.1
"""How long the thread may take to notice that it is to end."""

LARGEST_STEP_S = 1.0
"""A stamp further than this from when it should arrive means that the peer's clock was
set, or that its messages were held up; times are then counted anew."""

TICK_S = 1e-6
"""Step of a clock that has to be set anew but may not stand still."""

_READ_BYTES = 65536


class OpenIGTLinkSource(QueuedSource):
    """Poses of one tool of a peer; see ``LiveSource``.

    ``device_from_tip`` is the tool in the peer's world, in LPS. ``time_s`` follows the
    peer's time stamps, set to the host's monotonic clock at the first message, and
    always rises; ``host_time_s`` is when the message arrived. A peer that goes away is
    looked for until it is back.
    """

    def __init__(
        self,
        host: str,
        port: int,
        tool: str | None = None,
        *,
        patience_s: float = PATIENCE_S,
    ) -> None:
        """Connect; DeviceError when there is no peer within ``patience_s``.

        tool: name of the tool to follow; None follows the first one that is told of.
        """
        self._address = (host, port)
        self._tool = tool
        self._name = f"{host}:{port}"
        self._queue = PoseQueue(self._name)
        self._stop = threading.Event()
        self._reader = TransformReader()
        self._late = 0
        self._connections = 0
        # A stamp of the peer and the same moment on the host's clock.
        self._origin: tuple[float, float] | None = None
        self._newest_s = -math.inf
        connection = self._first_connection(patience_s)
        self._thread = threading.Thread(
            target=self._run, args=(connection,), name="openigtlink-in", daemon=True
        )
        self._thread.start()

    @property
    def tool(self) -> str | None:
        """Return the name of the tool that is followed, None while it is not known."""
        return self._tool

    @property
    def counters(self) -> dict[str, int]:
        """Return what happened on the line so far, by name."""
        return {
            "connections": self._connections,
            "foreign": self._reader.foreign,
            "damaged": self._reader.damaged,
            "refused": self._reader.refused,
            "garbage": self._reader.garbage,
            "late": self._late,
        }

    def close(self) -> None:
        """Leave the peer; harmless when repeated."""
        self._stop.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _first_connection(self, patience_s: float) -> socket.socket:
        until = time.monotonic() + patience_s
        while True:
            try:
                return self._connected(max(until - time.monotonic(), SLICE_S))
            except (OSError, UnicodeError) as error:
                if time.monotonic() + RETRY_S < until:
                    time.sleep(RETRY_S)
                    continue
                cause = getattr(error, "strerror", None) or str(error)
                raise DeviceError(
                    DeviceReason.NO_DEVICE,
                    f"No OpenIGTLink server answers at {self._name} ({cause}); start "
                    "it, or check the address.",
                ) from error

    def _connected(self, timeout_s: float) -> socket.socket:
        connection = socket.create_connection(self._address, timeout_s)
        connection.settimeout(SLICE_S)
        return connection

    def _run(self, connection: socket.socket) -> None:
        try:
            found: socket.socket | None = connection
            while found is not None:
                with found:
                    self._listen(found)
                found = self._found_again()
            self._queue.end()
        except Exception as error:
            # Nobody sees what a thread raises; the reader of the poses must.
            self._queue.fail(error)

    def _found_again(self) -> socket.socket | None:
        """Look for the peer until it is back; None when the source is closed."""
        while not self._stop.is_set():
            try:
                return self._connected(SLICE_S)
            except OSError:
                self._stop.wait(RETRY_S)
        return None

    def _listen(self, connection: socket.socket) -> None:
        """Take what comes until the peer goes away."""
        self._connections += 1
        # What was cut off does not go on in another connection, nor does a clock.
        self._reader.restart()
        self._origin = None
        while not self._stop.is_set():
            try:
                data = connection.recv(_READ_BYTES)
            except TimeoutError:
                continue
            except OSError:
                return
            if not data:
                return
            arrived = time.monotonic()
            for transform in self._reader.feed(data):
                self._take(transform, arrived)

    def _take(self, transform: ToolTransform, arrived_s: float) -> None:
        if self._tool is None:
            self._tool = transform.name
        if transform.name != self._tool:
            return
        time_s = self._aligned_s(transform.time_s, arrived_s)
        if time_s <= self._newest_s:
            self._late += 1
            return
        self._newest_s = time_s
        pose = Pose(time_s, arrived_s, transform.world_from_tool, 0)
        self._queue.put((pose,))

    def _aligned_s(self, stamp_s: float | None, arrived_s: float) -> float:
        """Bring a peer's stamp onto the host's monotonic clock."""
        if stamp_s is not None and self._origin is not None:
            time_s = self._origin[1] + (stamp_s - self._origin[0])
            if abs(time_s - arrived_s) <= LARGEST_STEP_S:
                return time_s
        # Several may arrive at once, or sooner than the last one was thought to.
        time_s = max(arrived_s, self._newest_s + TICK_S)
        self._origin = None if stamp_s is None else (stamp_s, time_s)
        return time_s
