"""Packets of every layout, drawn by hypothesis."""

from hypothesis import strategies as st

from devices.microscribe.wire.packets import Layout, Packet


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
