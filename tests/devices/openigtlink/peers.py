"""Waiting for the other end of a stream, not for ever."""

import time

from devices.openigtlink import PoseStreamer

PATIENCE_S = 30.0


def wait_for_peers(streamer: PoseStreamer) -> None:
    """Wait until somebody listens; fail when nobody does."""
    deadline = time.monotonic() + PATIENCE_S
    while not streamer.peers:
        assert time.monotonic() < deadline, f"no peer within {PATIENCE_S:g} s"
        time.sleep(0.001)
