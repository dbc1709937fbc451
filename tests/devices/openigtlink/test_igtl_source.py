"""Poses in: from pyigtl's own server, and from peers that behave badly."""

import contextlib
import itertools
import re
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pyigtl import OpenIGTLinkServer, TransformMessage

from devices.openigtlink import OpenIGTLinkSource, PoseStreamer, ToolTransform, encode
from devices.openigtlink.messages import RAS_FROM_LPS
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from tests.devices.openigtlink.peers import wait_for_peers

EPOCH_S = 1_792_134_567.0


def message(number: int, stamp: float | None = None, name: str = "Stylus") -> bytes:
    matrix = np.eye(4)
    matrix[0, 3] = number
    return encode(ToolTransform(name, stamp, matrix))


@pytest.fixture
def server() -> Iterator[Callable[[int], OpenIGTLinkServer]]:
    """Start pyigtl's server, which also takes over the process's signals."""
    handlers = {n: signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT)}
    started: list[OpenIGTLinkServer] = []

    def start(port: int) -> OpenIGTLinkServer:
        started.append(OpenIGTLinkServer(port))
        return started[-1]

    yield start
    for server in started:
        server.stop()
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    """A peer that the test plays by hand."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(30.0)
        yield listener


def at(listener: socket.socket, tool: str | None = None) -> OpenIGTLinkSource:
    return OpenIGTLinkSource("127.0.0.1", listener.getsockname()[1], tool)


@contextlib.contextmanager
def joined(
    listener: socket.socket, tool: str | None = None
) -> Iterator[tuple[OpenIGTLinkSource, socket.socket]]:
    """Give a source and the peer's end of its connection."""
    with at(listener, tool) as source, listener.accept()[0] as peer:
        yield source, peer


def xs(poses: list[Pose]) -> list[float]:
    return [float(pose.tip_mm[0]) for pose in poses]


def test_poses_of_pyigtls_server_come_with_their_times(
    server: Callable[[int], OpenIGTLinkServer],
) -> None:
    peer = server(0)
    port = peer.server_address[1]
    rng = np.random.default_rng(5)
    sent = []
    with OpenIGTLinkSource("127.0.0.1", port, "Stylus") as source:
        for number in range(20):
            rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            matrix = np.eye(4)
            matrix[:3, :3] = rotation * np.linalg.det(rotation)
            matrix[:3, 3] = rng.normal(size=3) * 100
            sent.append(matrix)
            stamp = EPOCH_S + 0.01 * number
            for name in ("Other", "Stylus"):
                peer.send_message(
                    TransformMessage(matrix, stamp, device_name=name), wait=False
                )
        got = [source.read(30.0) for _ in sent]
        for matrix, pose in zip(sent, got, strict=True):
            exact = RAS_FROM_LPS @ matrix.astype(np.float32).astype(np.float64)
            assert np.array_equal(pose.device_from_tip, exact)
        steps = np.diff([pose.time_s for pose in got])
        assert steps == pytest.approx(0.01, rel=0, abs=1e-6)
        assert got[0].time_s == got[0].host_time_s
        newest = source.latest()
        assert newest is got[-1]
        assert 0.0 <= source.pose_age_s() < float("inf")


def test_a_peer_that_disappears_is_found_again_when_it_returns(
    server: Callable[[int], OpenIGTLinkServer],
) -> None:
    first = server(0)
    port = first.server_address[1]
    with OpenIGTLinkSource("127.0.0.1", port) as source:
        first.send_message(TransformMessage(np.eye(4), 5.0, "Stylus"))
        before = source.read(30.0)
        first.stop()
        with pytest.raises(TimeoutError):
            source.read(0.05)
        # It is back with a clock that was set back.
        second = server(port)
        second.send_message(TransformMessage(np.eye(4), 1.0, "Stylus"))
        after = source.read(30.0)
        assert after.time_s > before.time_s
        assert source.counters["connections"] >= 2
        assert source.counters["late"] == 0


def test_our_own_stream_comes_back_exact_to_float32() -> None:
    rng = np.random.default_rng(6)
    with (
        PoseStreamer(0) as streamer,
        OpenIGTLinkSource(streamer.host, streamer.port) as source,
    ):
        wait_for_peers(streamer)
        for number in range(30):
            rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            matrix = np.eye(4)
            matrix[:3, :3] = rotation * np.linalg.det(rotation)
            matrix[:3, 3] = rng.normal(size=3) * 100
            streamer.publish("ScopeTipToPatient", matrix, 100.0 + 0.01 * number)
            pose = source.read(30.0)
            expected = matrix.astype(np.float32).astype(np.float64)
            assert np.array_equal(pose.device_from_tip, expected)
        assert source.tool == "ScopeTipToPatient"


def test_garbage_on_the_line_gives_no_pose_and_the_next_message_does(
    listener: socket.socket,
) -> None:
    noise = np.random.default_rng(7).integers(0, 256, 5000, np.uint8).tobytes()
    with joined(listener) as (source, peer):
        peer.sendall(message(1, 1.0) + noise + message(2, 1.01)[:90])
        peer.sendall(message(3, 1.02) + message(4, 1.03))
        assert xs([source.read(30.0) for _ in range(3)]) == [1.0, 3.0, 4.0]
        assert source.counters["garbage"] >= 5000
        assert source.counters["damaged"] == 1
        with pytest.raises(TimeoutError):
            source.read(0.0)
        assert source.drain() == []


@pytest.mark.parametrize(
    ("wanted", "expected"), [(None, [0.0, 1.0, 2.0]), ("B", [10.0, 11.0, 12.0])]
)
def test_the_first_tool_is_followed_unless_one_is_named(
    listener: socket.socket, wanted: str | None, expected: list[float]
) -> None:
    # One listener each: a source that lost its peer knocks again until it is closed.
    both = b"".join(
        message(10 * k + i, 1.0 + i, name)
        for i in range(3)
        for k, name in enumerate(("A", "B"))
    )
    with joined(listener, wanted) as (source, peer):
        peer.sendall(both)
        assert xs([source.read(30.0) for _ in range(3)]) == expected
        assert source.tool == (wanted or "A")


def test_time_always_rises_whatever_the_peers_clock_does(
    listener: socket.socket,
) -> None:
    stamps = [100.0, 100.01, 100.01, 99.995, 100.02, 9000.0, 9000.01, 50.0, None, 50.1]
    with joined(listener) as (source, peer):
        for number, stamp in enumerate(stamps):
            peer.sendall(message(number, stamp))
            if number not in (2, 3):
                assert xs([source.read(30.0)]) == [float(number)]
        assert source.counters["late"] == 2


def test_times_follow_the_stamps_and_not_the_arrival(listener: socket.socket) -> None:
    with joined(listener) as (source, peer):
        # A burst: held up on the way, measured at even times.
        peer.sendall(b"".join(message(i, EPOCH_S + i / 64) for i in range(32)))
        got = [source.read(30.0) for _ in range(32)]
        assert np.diff([p.time_s for p in got]) == pytest.approx(1 / 64, abs=1e-6)
        assert all(p.host_time_s >= got[0].host_time_s for p in got)


def test_nobody_there_is_told_in_one_sentence(listener: socket.socket) -> None:
    port = listener.getsockname()[1]
    listener.close()
    for host, patience_s in (("127.0.0.1", 0.0), ("no host", 0.0)):
        with pytest.raises(DeviceError, match=f"{host}:{port}") as caught:
            OpenIGTLinkSource(host, port, patience_s=patience_s)
        assert caught.value.reason is DeviceReason.NO_DEVICE
        assert str(caught.value).count(".") <= 4
    assert "openigtlink-in" not in {t.name for t in threading.enumerate()}


def test_closing_ends_iteration_and_the_thread(listener: socket.socket) -> None:
    source = at(listener)
    peer, _ = listener.accept()
    with peer:
        peer.sendall(message(1, 1.0) + message(2, 2.0))
        poses = iter(source)
        assert xs([next(poses), next(poses)]) == [1.0, 2.0]
        threading.Timer(0.05, source.close).start()
        assert list(poses) == []
    source.close()
    with pytest.raises(EOFError):
        source.read(1.0)
    assert "openigtlink-in" not in {t.name for t in threading.enumerate()}


def moved(number: int, name: str = "Stylus", scale: float = 1.0) -> bytes:
    """Compose a pose that trembles, at some 100 mm."""
    matrix = np.eye(4)
    matrix[:3, 3] = np.array([100.0, -20.0, 30.0 + 0.01 * number]) * scale
    return encode(ToolTransform(name, EPOCH_S + 0.02 * number, matrix))


def read_all(
    source: OpenIGTLinkSource, peer: socket.socket, frames: Iterator[bytes]
) -> None:
    """Send one pose after another, as a tracker does, and read what comes of them."""
    for frame in frames:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            peer.sendall(frame)
        with contextlib.suppress(TimeoutError):
            source.read(0.05)


def test_a_reference_is_no_tool(listener: socket.socket) -> None:
    with joined(listener) as (source, peer):
        peer.sendall(moved(0, "ReferenceToTracker") + moved(1, "HeadToTracker"))
        peer.sendall(moved(2, "StylusToReference"))
        source.read(30.0)
        assert source.tool == "StylusToReference"


def test_a_silent_tool_is_lost_and_found(listener: socket.socket) -> None:
    """Its peer is there, and may send other things; once it is told what."""
    with joined(listener, "Stylus") as (source, peer):
        peer.sendall(moved(0))
        source.read(30.0)
        peer.sendall(moved(1, "Other"))
        with pytest.raises(DeviceError, match=r"Stylus.*poses of Other") as told:
            source.read(30.0)
        assert told.value.reason is DeviceReason.DISCONNECTED
        with pytest.raises(TimeoutError):
            source.read(0.1)
        peer.sendall(moved(200))
        assert source.read(30.0).tip_mm[2] == pytest.approx(32.0, abs=1e-4)


def test_a_pose_that_never_trembles_is_lost(listener: socket.socket) -> None:
    """The last one of a tool that is not seen any more, again and again."""
    with joined(listener) as (source, peer):
        # as many as it takes: a quick peer sends thousands before a pose counts as lost
        until = time.monotonic() + 30.0
        numbers = itertools.takewhile(
            lambda _: time.monotonic() < until, itertools.count()
        )
        frames = (message(100, EPOCH_S + 0.02 * n) for n in numbers)
        with pytest.raises(DeviceError, match="does not change at all"):
            read_all(source, peer, frames)
        assert source.counters["unseen"] > 3
        peer.sendall(moved(1_000_000))
        source.read(30.0)


def test_metres_are_refused(listener: socket.socket) -> None:
    with joined(listener) as (source, peer):
        peer.sendall(b"".join(moved(n, scale=1e-3) for n in range(80)))
        near = (moved(n, scale=1e-3) for n in range(80))
        with pytest.raises(DeviceError, match="millimetres"):
            read_all(source, peer, near)


def test_who_waits_in_slices_is_told_of_the_whole_wait(listener: socket.socket) -> None:
    with joined(listener) as (source, _peer):
        until = time.monotonic() + 0.6
        while time.monotonic() < until:
            with pytest.raises(TimeoutError) as told:
                source.read(0.03)
        assert re.search(r"for 0\.[56]\d* s; what came", str(told.value))


def test_the_peer_is_spoken_to_in_the_second_version(listener: socket.socket) -> None:
    """PLUS says nothing of whether a tool is seen to who does not."""
    with joined(listener) as (_source, peer):
        assert peer.recv(2, socket.MSG_WAITALL) == b"\0\2"
