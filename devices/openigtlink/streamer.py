"""A server that streams tool poses to whoever connects.

One thread owns all sockets; whoever publishes only puts messages into queues and goes
on. A peer that reads too slowly loses its oldest messages; the others do not notice.
"""

import contextlib
import math
import selectors
import socket
import threading
import time
from collections import deque

import numpy as np
from numpy.typing import NDArray

from devices.openigtlink.messages import ToolTransform, check_name, encode
from devices.port import Closing, DeviceError, DeviceReason
from system import UserError

LOOPBACK = "127.0.0.1"

MOST_PEERS = 8

LONGEST_QUEUE = 64
"""Messages for one peer: two tools at 100 Hz over a third of a second."""

SEND_BUFFER_BYTES = 16384
"""What the kernel may hold back. By default it holds minutes of old poses."""

_READ_BYTES = 65536


class _Peer:
    """A connected peer and what it has not been sent yet; the streamer locks it."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.waiting: deque[bytes] = deque()
        self.rest = b""
        """Of a message that was sent in part."""

    @property
    def has_news(self) -> bool:
        return bool(self.rest or self.waiting)


class PoseStreamer(Closing):
    """Stream tool poses by OpenIGTLink; a context manager.

    Peers may come and go, send what they like and read as slowly as they like.
    """

    def __init__(self, port: int, host: str = LOOPBACK) -> None:
        """Listen at once; port 0 takes a free one.

        host: address to listen at; by default only this machine can connect.
        Raises UserError for an impossible port and DeviceError when it is taken or
        not allowed.
        """
        if not 0 <= port <= 65535:
            raise UserError(f"a port must lie between 0 and 65535, got {port}")
        try:
            self._server = socket.create_server((host, port))
        except OSError as error:
            raise DeviceError(
                DeviceReason.NO_PORT,
                f"OpenIGTLink cannot be streamed at {host}:{port} ({error.strerror}); "
                "choose another port.",
            ) from error
        self._wake_out, self._wake_in = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        self.host, self.port = self._server.getsockname()[:2]
        self._lock = threading.Lock()
        self._peers: list[_Peer] = []
        self._dropped = 0
        self._is_closing = False
        # Set once: a step of the wall clock must not tear the stream apart.
        self._epoch_s = time.time() - time.monotonic()
        for sock in (self._server, self._wake_in, self._wake_out):
            sock.setblocking(False)
        self._selector.register(self._server, selectors.EVENT_READ)
        self._selector.register(self._wake_in, selectors.EVENT_READ)
        self._thread = threading.Thread(
            target=self._run, name="openigtlink-out", daemon=True
        )
        self._thread.start()

    @property
    def peers(self) -> int:
        """Return how many peers are connected."""
        with self._lock:
            return len(self._peers)

    @property
    def dropped(self) -> int:
        """Return how many messages were lost because a peer read too slowly."""
        with self._lock:
            return self._dropped

    def publish(
        self, name: str, world_from_tool: NDArray[np.float64], host_time_s: float
    ) -> None:
        """Send a pose to every peer; never waits.

        name: of the tool, at most 20 bytes. world_from_tool: (4, 4), LPS, mm.
        host_time_s: on the host's monotonic clock; the message carries the same
        moment in seconds since 1970. Raises UserError for a matrix that is not rigid.
        """
        if not math.isfinite(host_time_s):
            raise UserError(f"host_time_s must be finite, got {host_time_s}")
        stamp = host_time_s + self._epoch_s
        check_name(name)
        transform = ToolTransform(name, stamp, world_from_tool)
        with self._lock:
            if not self._peers or self._is_closing:
                return
            message = encode(transform)
            for peer in self._peers:
                if len(peer.waiting) == LONGEST_QUEUE:
                    peer.waiting.popleft()
                    self._dropped += 1
                peer.waiting.append(message)
            self._wake()

    def close(self) -> None:
        """Disconnect everybody and let go of the port; harmless when repeated."""
        with self._lock:
            if self._is_closing:
                return
            self._is_closing = True
            self._wake()
        self._thread.join()

    def _wake(self) -> None:
        # When the line is full of calls to wake up, one more is not needed.
        with contextlib.suppress(BlockingIOError):
            self._wake_out.send(b"\0")

    def _run(self) -> None:
        while not self._is_closing:
            for key, events in self._selector.select():
                if key.fileobj is self._server:
                    self._welcome()
                elif key.fileobj is self._wake_in:
                    self._wake_in.recv(_READ_BYTES)
                elif isinstance(key.data, _Peer):
                    self._serve(key.data, events)
            self._watch()
        for peer in list(self._peers):
            self._part(peer)
        self._selector.close()
        for sock in (self._server, self._wake_in, self._wake_out):
            sock.close()

    def _welcome(self) -> None:
        try:
            connection, _ = self._server.accept()
        except OSError:
            # It went away again before it was its turn.
            return
        if len(self._peers) == MOST_PEERS:
            connection.close()
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        peer = _Peer(connection)
        with self._lock:
            self._peers.append(peer)
        self._selector.register(connection, selectors.EVENT_READ, peer)

    def _serve(self, peer: _Peer, events: int) -> None:
        try:
            # Whatever a peer says is read, so that it does not get stuck, and dropped.
            if events & selectors.EVENT_READ and not peer.connection.recv(_READ_BYTES):
                self._part(peer)
                return
            if events & selectors.EVENT_WRITE:
                self._send(peer)
        except BlockingIOError:
            return
        except OSError:
            self._part(peer)

    def _send(self, peer: _Peer) -> None:
        with self._lock:
            data = peer.rest + b"".join(peer.waiting)
            peer.waiting.clear()
            peer.rest = data
        # Sent outside of the lock: publishers do not wait for the kernel.
        peer.rest = data[peer.connection.send(data) :]

    def _watch(self) -> None:
        """Ask to be told when a peer for which there is news can take it."""
        with self._lock:
            wanted = [(peer, peer.has_news) for peer in self._peers]
        for peer, has_news in wanted:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE * has_news)
            self._selector.modify(peer.connection, events, peer)

    def _part(self, peer: _Peer) -> None:
        self._selector.unregister(peer.connection)
        with self._lock:
            self._peers.remove(peer)
        peer.connection.close()
