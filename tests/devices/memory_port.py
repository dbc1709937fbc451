"""A line inside this process, for tests without terminals."""

import threading
from collections import deque

from devices.port import DeviceError, DeviceReason, burst


class _Pipe:
    """One direction of a memory line."""

    def __init__(self) -> None:
        self.data: deque[int] = deque()
        self.changed = threading.Condition()
        self.open = True


class MemoryPort:
    """One end of a line inside this process."""

    def __init__(self, name: str, inbound: _Pipe, outbound: _Pipe) -> None:
        self._name = name
        self._in = inbound
        self._out = outbound
        self.rate: int | None = None

    @property
    def name(self) -> str:
        """Get the name given at birth."""
        return self._name

    @property
    def waiting(self) -> int:
        """Get how many bytes have arrived unread."""
        with self._in.changed:
            if not self._in.open and not self._in.data:
                raise self._gone()
            return len(self._in.data)

    def read(self, count: int, timeout_s: float) -> bytes:
        """Return up to ``count`` bytes, fewer when the timeout ends first."""
        pipe = self._in
        with pipe.changed:
            pipe.changed.wait_for(
                lambda: len(pipe.data) >= count or not pipe.open, max(timeout_s, 0.0)
            )
            if not pipe.open and not pipe.data:
                raise self._gone()
            return bytes(pipe.data.popleft() for _ in range(min(count, len(pipe.data))))

    def read_burst(self, count: int, timeout_s: float, quiet_s: float) -> bytes:
        """Read as ``read`` does, but end when the line falls quiet after a byte."""
        return burst(self, count, timeout_s, quiet_s)

    def read_some(self, least: int, timeout_s: float) -> bytes:
        """Return all there is once ``least`` bytes are; fewer after the timeout."""
        return self.read(max(least, len(self._in.data)), timeout_s)

    def write(self, data: bytes) -> None:
        """Append ``data`` to what the far end will read."""
        pipe = self._out
        with pipe.changed:
            if not pipe.open:
                raise self._gone()
            pipe.data.extend(data)
            pipe.changed.notify_all()

    def reset_input(self) -> int:
        """Drop what has arrived unread; return how many bytes that was."""
        with self._in.changed:
            count = len(self._in.data)
            self._in.data.clear()
            return count

    def set_rate(self, baud: int) -> None:
        """Remember the rate; memory has none."""
        self.rate = baud

    def close(self) -> None:
        """Close both directions for both ends."""
        for pipe in (self._in, self._out):
            with pipe.changed:
                pipe.open = False
                pipe.changed.notify_all()

    def _gone(self) -> DeviceError:
        return DeviceError(
            DeviceReason.DISCONNECTED, f"The far end of {self._name} was closed."
        )


def memory_port_pair(name: str = "memory") -> tuple[MemoryPort, MemoryPort]:
    """Return two ports; what one writes the other reads."""
    there, back = _Pipe(), _Pipe()
    return MemoryPort(name, back, there), MemoryPort(name, there, back)
