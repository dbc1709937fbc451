"""Poses from an OpenIGTLink peer, such as a tracker's server or 3D Slicer."""

import contextlib
import math
import socket
import threading
import time
from collections import Counter

import numpy as np

from devices.openigtlink.messages import (
    MOST_TOLD,
    ToolTransform,
    TransformReader,
    greeting,
)
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

SILENT_S = 2.0
"""Without a pose for so long a tool is lost, whatever else its peer sends."""

FROZEN_S = 1.0
"""A tracker's poses tremble. One that comes again and again, to the bit, is the last
one of a tool that is not seen any more."""

METRES_MM, METRES_POSES = 1.0, 50
"""So many poses that differ and lie all so near to their origin are in metres."""

REFERENCES = ("ref", "headto", "patientto", "trackerto")
"""How names begin of what lies still while tools are tracked; it is no tool."""

_READ_BYTES = 65536


class OpenIGTLinkSource(QueuedSource):
    """Poses of one tool of a peer; see ``QueuedSource``.

    ``device_from_tip`` is the tool in the peer's world, in LPS. ``time_s`` follows the
    peer's time stamps, set to the host's monotonic clock at the first message, and
    always rises; ``host_time_s`` is when the message arrived. Poses of a tool that is
    not seen, or that stands as no tracker's does, are left out. A peer that goes away
    is looked for until it is back; that, and that it sends nothing of the tool for two
    seconds, is a DeviceError of the next ``read``, once.
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

        tool: name of the tool to follow; None follows the first one that is told of and
        is no reference.
        """
        self._address = (host, port)
        self.tool = tool
        """The tool that is followed, None while it is not known."""
        self._name = f"{host}:{port}"
        self._queue = PoseQueue(self._name, silence=self._silence_for)
        self._stop = threading.Event()
        self._reader = TransformReader()
        self._late = 0
        self._connections = 0
        # A stamp of the peer and the same moment on the host's clock.
        self._origin: tuple[float, float] | None = None
        self._newest_s = -math.inf
        self._unseen: Counter[str] = Counter()
        self._names: list[str] = []
        self._still: tuple[bytes, float] = b"", -math.inf
        self._near, self._last = 0, b""
        self._heard_s = math.inf
        """When the last pose was taken, or lost; inf while there is none to lose."""
        connection = self._first_connection(patience_s)
        self._thread = threading.Thread(
            target=self._run, args=(connection,), name="openigtlink-in", daemon=True
        )
        self._thread.start()

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
            "unseen": sum(self._unseen.values()),
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
        with contextlib.suppress(OSError):
            connection.sendall(greeting())
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
            self._notice_silence()
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
            self._notice_silence()
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
        name = transform.name
        if name not in self._names and len(self._names) < MOST_TOLD:
            self._names.append(name)
        if self.tool is None and not name.lower().startswith(REFERENCES):
            self.tool = name
        if name != self.tool:
            return
        unseen = transform.status or self._frozen(transform, arrived_s)
        if unseen:
            self._unseen[unseen] += 1
            return
        self._check_unit(transform)
        time_s = self._aligned_s(transform.time_s, arrived_s)
        if time_s <= self._newest_s:
            self._late += 1
            return
        self._newest_s, self._heard_s = time_s, arrived_s
        pose = Pose(time_s, arrived_s, transform.world_from_tool, 0)
        self._queue.put((pose,))

    def _frozen(self, transform: ToolTransform, arrived_s: float) -> str:
        """Return why a pose that does not change counts for nothing."""
        frame = transform.world_from_tool.tobytes()
        if frame != self._still[0]:
            self._still = frame, arrived_s
        is_frozen = arrived_s - self._still[1] > FROZEN_S
        return "the tool's pose does not change at all" if is_frozen else ""

    def _check_unit(self, transform: ToolTransform) -> None:
        """Refuse metres; DeviceError."""
        if self._near < 0 or self._still[0] == self._last:
            return
        self._last = self._still[0]
        is_near = float(np.abs(transform.world_from_tool[:3, 3]).max()) < METRES_MM
        self._near = self._near + 1 if is_near else -1
        if self._near >= METRES_POSES:
            raise DeviceError(
                DeviceReason.BAD_REPLY,
                f"{self._name} sends places of {self.tool} within {METRES_MM:g} mm of "
                "its origin, as metres are; let it send millimetres.",
            )

    def _notice_silence(self) -> None:
        """Tell once that the tool is lost, while its peer is there."""
        now_s = time.monotonic()
        if now_s - self._heard_s > SILENT_S:
            text = self._silence_for(now_s - self._heard_s)
            self._heard_s = math.inf
            self._queue.tell(DeviceError(DeviceReason.DISCONNECTED, f"{text}."))

    def _silence_for(self, time_s: float) -> str:
        """Say that nothing came for so long, and what came instead."""
        tool = "any tool" if self.tool is None else self.tool
        came = [f"{count} poses, but {why}" for why, count in self._unseen.items()]
        reasons = self._reader.reasons
        came += [f"{count} messages {why}" for why, count in reasons.items()]
        others = [name for name in self._names if name != self.tool]
        came += [f"poses of {', '.join(others)}"] * bool(others)
        message = f"no pose of {tool} came from {self._name} for {time_s:.1f} s"
        return f"{message}; what came so far: {'; '.join(came) or 'nothing'}"

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
