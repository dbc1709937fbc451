"""Packets of every layout, drawn by hypothesis, and their bytes."""

from hypothesis import strategies as st

from devices.microscribe.wire.packets import Layout, Packet
from disk import UserError


@st.composite
def packets(draw: st.DrawFn, command: int | None = None) -> Packet:
    """Draw a packet, of one command if it is given."""
    code = command if command is not None else draw(st.integers(0, 0x3F))
    layout = Layout(code)
    # The lowest bit of the eighth channel does not travel.
    analog = [draw(st.integers(0, 255)) for _ in range(layout.analog)]
    if layout.analog == 8:
        analog[7] &= ~1
    return Packet(
        command=code,
        buttons=draw(st.integers(0, 127)),
        timer=draw(st.integers(0, 16383)) if layout.timed else None,
        analog=tuple(analog),
        counts=tuple(draw(st.integers(0, 16383)) for _ in range(layout.encoders)),
    )


def encode_packet(packet: Packet) -> bytes:
    """Return the bytes of ``packet``; counts beyond the layout are left out."""
    layout = Layout(packet.command)
    if len(packet.counts) < layout.encoders or len(packet.analog) < layout.analog:
        raise UserError(f"command {packet.command:02x} wants more values: {packet}")
    out = bytearray((layout.header, packet.buttons & 0x7F))
    if layout.timed:
        if packet.timer is None:
            raise UserError(f"command {packet.command:02x} wants a timer: {packet}")
        out += _pair(packet.timer)
    if layout.analog:
        channels = packet.analog[: layout.analog]
        out += bytes(value >> 1 for value in channels)
        out.append(sum((value & 1) << 6 - i for i, value in enumerate(channels[:7])))
    for count in packet.counts[: layout.encoders]:
        out += _pair(count)
    return bytes(out)


def _pair(value: int) -> bytes:
    return bytes((value >> 7 & 0x7F, value & 0x7F))
