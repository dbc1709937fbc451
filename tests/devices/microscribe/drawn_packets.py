"""Packets of every layout, drawn by hypothesis, and their bytes."""

from hypothesis import strategies as st

from devices.microscribe.emulator.packet import Reading, standard_packet
from devices.microscribe.kinematics.profiles import MICROSCRIBE_CODES
from devices.microscribe.wire.packets import Packet, PacketLayout


@st.composite
def packets(draw: st.DrawFn, command: int | None = None) -> Packet:
    """Draw a packet, of one command if it is given."""
    code = command if command is not None else draw(st.integers(0, 0x3F))
    layout = PacketLayout(code)
    return Packet(
        command=code,
        buttons=draw(st.integers(0, 127)),
        timer=draw(st.integers(0, 16383)) if layout.timed else None,
        counts=tuple(draw(st.integers(0, 16383)) for _ in range(layout.encoders)),
    )


def encode_packet(packet: Packet) -> bytes:
    """Return the bytes of a packet, as the emulated arm sends it."""
    reading = Reading(packet.counts, packet.buttons)
    timer = packet.timer or 0
    return standard_packet(packet.command, reading, timer, MICROSCRIBE_CODES)
