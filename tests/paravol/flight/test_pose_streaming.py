"""What a session streams, seen by pyigtl's own client."""

import numpy as np
import pytest
from pyigtl import OpenIGTLinkClient

from devices import Pose
from paravol.exchange.tool_motion import INSTRUMENT, SCOPE
from paravol.flight.pose_streaming import listening_address, publish_sample, streaming
from paravol.inputs.pose_completer import AWAY_MM, HandChannel
from tests.devices.openigtlink.peers import PATIENCE_S, wait_for_peers


def test_every_sample_is_streamed_in_the_patients_frame() -> None:
    world_from_device = np.eye(4)
    world_from_device[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    world_from_device[:3, 3] = 1.0, 2.0, 3.0
    pose = np.eye(4)
    pose[:3, 3] = 10.0, 20.0, 30.0
    with streaming(("127.0.0.1", 0)) as streamer:
        assert streamer is not None
        channel = HandChannel()
        client = OpenIGTLinkClient(streamer.host, streamer.port)
        try:
            wait_for_peers(streamer)
            for number in range(3):
                measured = Pose(number * 0.01, 50.0 + number * 0.01, pose, 0)
                sample = channel.complete(measured)
                publish_sample(streamer, world_from_device, True, sample, measured)
                scope = client.wait_for_message(SCOPE, timeout=PATIENCE_S)
                tool = client.wait_for_message(INSTRUMENT, timeout=PATIENCE_S)
                # LPS (-19, 12, 33), as a RAS peer must see it.
                assert scope.matrix[:3, 3].tolist() == [19.0, -12.0, 33.0]
                assert tool.matrix[:3, 3] == pytest.approx(AWAY_MM * (-1, -1, 1))
                assert scope.timestamp == tool.timestamp
        finally:
            client.stop()


def test_without_an_address_nothing_is_opened() -> None:
    with streaming(None) as streamer:
        assert streamer is None


def test_addresses_are_local_unless_a_host_is_named() -> None:
    assert listening_address("18944") == ("127.0.0.1", 18944)
    assert listening_address("0.0.0.0:0") == ("0.0.0.0", 0)
    for text in ("", "x", "host:", "65536", "-1", "1.5", "²"):
        with pytest.raises(ValueError, match="--stream-igtl"):
            listening_address(text)
