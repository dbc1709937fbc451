"""Poses out: to pyigtl's own client, and to peers that behave badly."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray
from pyigtl import OpenIGTLinkClient

from devices.openigtlink import PoseStreamer, ToolTransform, TransformReader
from devices.openigtlink.streamer import LONGEST_QUEUE, MOST_PEERS
from devices.port import DeviceError, DeviceReason
from tests.devices.openigtlink.peers import wait_for_peers

SCOPE = "ScopeTipToPatient"
TOOL = "InstrumentToPatient"


def matrix(number: float) -> NDArray[np.float64]:
    turn = 0.1 * number
    made = np.eye(4)
    made[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    made[:3, 3] = number, 2.0 * number, -number
    return made


@pytest.fixture
def streamer() -> Iterator[PoseStreamer]:
    with PoseStreamer(0) as streamer:
        yield streamer


@contextmanager
def connected(
    streamer: PoseStreamer, buffer_bytes: int | None = None
) -> Iterator[socket.socket]:
    """A peer whose connection the streamer has noticed."""
    before = streamer.peers
    with socket.socket() as peer:
        if buffer_bytes is not None:
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
        peer.settimeout(30.0)
        peer.connect((streamer.host, streamer.port))
        while streamer.peers == before:
            time.sleep(0.001)
        yield peer


def received(peer: socket.socket, count: int) -> list[ToolTransform]:
    reader = TransformReader()
    got: list[ToolTransform] = []
    while len(got) < count:
        data = peer.recv(4096)
        assert data, "the streamer hung up"
        got += reader.feed(data)
    assert reader.garbage == reader.damaged == 0
    return got


def test_pyigtl_gets_both_tools_with_their_times(streamer: PoseStreamer) -> None:
    client = OpenIGTLinkClient(streamer.host, streamer.port)
    try:
        wait_for_peers(streamer)
        wall_s = time.time() - time.monotonic()
        stamps = []
        for number in range(5):
            host_s = 1000.0 + 0.01 * number
            streamer.publish(SCOPE, matrix(number), host_s)
            streamer.publish(TOOL, matrix(-number), host_s)
            scope = client.wait_for_message(SCOPE, timeout=30)
            tool = client.wait_for_message(TOOL, timeout=30)
            expected = matrix(number).astype(np.float32)
            expected[:2] *= -1
            assert np.array_equal(scope.matrix, expected)
            assert tool.matrix[0, 3] == number
            assert scope.timestamp == tool.timestamp
            stamps.append(scope.timestamp)
        # Seconds since 1970 of the same moments; steps are those of the poses.
        assert stamps[0] == pytest.approx(1000.0 + wall_s, abs=0.1)
        assert np.diff(stamps) == pytest.approx(0.01, rel=0, abs=1e-6)
    finally:
        client.stop()


def test_every_pose_is_sent_once_and_in_order(streamer: PoseStreamer) -> None:
    with connected(streamer) as peer:
        for number in range(10 * LONGEST_QUEUE):
            streamer.publish(SCOPE, matrix(number), float(number))
            if number % (LONGEST_QUEUE // 2) == 0:
                got = received(peer, 1 if number == 0 else LONGEST_QUEUE // 2)
                assert got[-1].world_from_tool[0, 3] == number
        assert streamer.dropped == 0


def test_a_peer_that_does_not_read_blocks_nobody(streamer: PoseStreamer) -> None:
    with connected(streamer, 4096) as slow, connected(streamer) as quick:
        total = 0
        # Until all buffers on the way to the slow one are full; then more.
        while streamer.dropped == 0 or total % 16:
            streamer.publish(SCOPE, matrix(0), float(total))
            total += 1
            if total % 16 == 0:
                received(quick, 16)
        final = 800
        for number in range(final):
            streamer.publish(SCOPE, matrix(number), float(total + number))
            if (number + 1) % 8 == 0:
                received(quick, 8)
        assert streamer.dropped > final // 2
        # What the slow one finds is old, but whole, in order, and ends with the newest.
        reader = TransformReader()
        got: list[ToolTransform] = []
        while not got or got[-1].world_from_tool[0, 3] != final - 1:
            got += reader.feed(slow.recv(65536))
        assert reader.garbage == reader.damaged == 0
        times = [t.time_s for t in got if t.time_s is not None]
        assert times == sorted(set(times))
        assert len(times) == total + final - streamer.dropped


def test_peers_come_and_go_and_come_back(streamer: PoseStreamer) -> None:
    for number in range(3):
        with connected(streamer) as peer:
            streamer.publish(SCOPE, matrix(number), 0.0)
            assert received(peer, 1)[0].world_from_tool[0, 3] == number
        while streamer.peers:
            streamer.publish(SCOPE, matrix(9), 0.0)
            time.sleep(0.001)
    # Nothing was kept for a peer that was not there.
    with connected(streamer) as peer:
        streamer.publish(SCOPE, matrix(7), 0.0)
        assert [t.world_from_tool[0, 3] for t in received(peer, 1)] == [7.0]


def test_whatever_a_peer_sends_disturbs_nothing(streamer: PoseStreamer) -> None:
    noise = np.random.default_rng(3).integers(0, 256, 300_000, np.uint8).tobytes()
    with connected(streamer) as peer:
        peer.sendall(noise + b"GET / HTTP/1.1\r\n\r\n" + b"\0\1TRANSFORM")
        streamer.publish(SCOPE, matrix(3), 0.0)
        assert received(peer, 1)[0].world_from_tool[0, 3] == 3.0


def test_too_many_peers_are_turned_away(streamer: PoseStreamer) -> None:
    address = (streamer.host, streamer.port)
    peers = [socket.create_connection(address, 30.0) for _ in range(MOST_PEERS)]
    while streamer.peers < MOST_PEERS:
        time.sleep(0.001)
    with socket.create_connection(address, 30.0) as late:
        assert late.recv(1) == b""
    assert streamer.peers == MOST_PEERS
    for peer in peers:
        peer.close()


def test_only_this_machine_can_connect_unless_told_otherwise() -> None:
    with PoseStreamer(0) as local, PoseStreamer(0, "0.0.0.0") as open_to_all:
        assert local.host == "127.0.0.1"
        assert open_to_all.host == "0.0.0.0"


def test_a_taken_port_and_an_impossible_one_are_named() -> None:
    with PoseStreamer(0) as first:
        with pytest.raises(DeviceError, match=f":{first.port} ") as caught:
            PoseStreamer(first.port)
        assert caught.value.reason is DeviceReason.NO_PORT
    with pytest.raises(ValueError, match="70000"):
        PoseStreamer(70000)


def test_closing_hangs_up_frees_the_port_and_leaves_no_thread() -> None:
    streamer = PoseStreamer(0)
    with connected(streamer) as peer:
        streamer.close()
        streamer.close()
        assert peer.recv(1) == b""
    streamer.publish(SCOPE, matrix(0), 0.0)
    assert "openigtlink-out" not in {t.name for t in threading.enumerate()}
    with PoseStreamer(streamer.port) as again:
        assert again.port == streamer.port


def test_poses_that_are_none_are_refused_with_and_without_a_peer(
    streamer: PoseStreamer,
) -> None:
    for name, made, at_s, named in (
        ("x" * 21, matrix(0), 0.0, "20 bytes"),
        (SCOPE, np.full((4, 4), np.nan), 0.0, "finite"),
        (SCOPE, matrix(0), float("nan"), "host_time_s"),
    ):
        with pytest.raises(ValueError, match=named):
            streamer.publish(name, made, at_s)
