"""A session's tool poses, streamed to navigation software while it is flown."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from paravol.exchange.tool_motion import INSTRUMENT, SCOPE
from scenarios import Sample
from scenarios.sample import tool_frame
from system import UserError

if TYPE_CHECKING:
    from devices.openigtlink import PoseStreamer


def publish_sample(
    streamer: "PoseStreamer",
    world_from_device: NDArray[np.float64],
    has_instrument: bool,
    sample: Sample,
    pose: Pose,
) -> None:
    """Publish where a sample's tools are in the patient.

    Never waits for those who listen. pose: of the sample, for its time.
    """
    frame = world_from_device @ sample.device_from_tip
    streamer.publish(SCOPE, frame, pose.host_time_s)
    if has_instrument:
        streamer.publish(INSTRUMENT, tool_frame(sample), pose.host_time_s)


def listening_address(text: str) -> tuple[str, int]:
    """Read ``[HOST:]PORT``; without a host only this machine can connect.

    UserError for anything else.
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
