"""A session's tool poses, streamed to navigation software while it is flown."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from disk import UserError
from paravol.exchange.tool_motion import INSTRUMENT, SCOPE
from paravol.inputs.pose_completer import PoseCompleter
from scenarios import Sample
from scenarios.sample import tool_frame

if TYPE_CHECKING:
    from devices.openigtlink import PoseStreamer


@dataclass(slots=True)
class StreamingCompleter:
    """Pass samples on and publish where their tools are in the patient."""

    completer: PoseCompleter
    streamer: "PoseStreamer"
    world_from_device: NDArray[np.float64]
    has_instrument: bool

    def complete(self, pose: Pose) -> Sample:
        """Complete a pose and publish it; never waits for those who listen."""
        sample = self.completer.complete(pose)
        world_from_tip = self.world_from_device @ sample.device_from_tip
        self.streamer.publish(SCOPE, world_from_tip, pose.host_time_s)
        if self.has_instrument:
            self.streamer.publish(INSTRUMENT, tool_frame(sample), pose.host_time_s)
        return sample


def listening_address(text: str) -> tuple[str, int]:
    """Read ``[HOST:]PORT``; without a host only this machine can connect.

    Raises ValueError for anything else.
    """
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdigit() and int(port) < 65536):
        raise UserError(
            f"--stream-igtl must be PORT or HOST:PORT, such as 18944; got {text!r}."
        )
    return host or "127.0.0.1", int(port)


@contextmanager
def streaming(address: tuple[str, int] | None) -> Iterator["PoseStreamer | None"]:
    """Listen at an address while the block runs; nowhere when there is none."""
    if address is None:
        yield None
        return
    # Imported here: only streaming needs this library.
    from devices.openigtlink import PoseStreamer

    host, port = address
    with PoseStreamer(port, host) as streamer:
        yield streamer
