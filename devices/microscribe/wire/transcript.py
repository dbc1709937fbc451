"""What was said on the line, in both directions, for a person to read.

One line of text each: seconds, direction (``>`` to the arm), the session's state, the
bytes, what they mean.
"""

from typing import TextIO

from devices.microscribe.wire import commands
from devices.microscribe.wire.commands import Command
from devices.microscribe.wire.protocol import (
    BadReply,
    Event,
    ProductId,
    Reply,
    Sample,
    State,
    SyncEcho,
)
from devices.microscribe.wire.readable import readable


class Transcript:
    """Write every byte of a session to a text stream."""

    def __init__(self, stream: TextIO) -> None:
        """Write to ``stream``, which stays open and belongs to the caller."""
        self._stream = stream

    def sent(self, time_s: float, state: State, command: Command) -> None:
        """Note a command and the state in which it left the session."""
        self._write(time_s, ">", state, command.data, commands.meaning(command))

    def received(
        self, time_s: float, state: State, data: bytes, events: list[Event]
    ) -> None:
        """Note bytes and the state in which they left the session."""
        if data:
            told = "; ".join(map(_meaning, events)) or "..."
            self._write(time_s, "<", state, data, told)

    def dropped(self, time_s: float, state: State, count: int) -> None:
        """Note bytes that were thrown away unread."""
        if count:
            self._write(time_s, "<", state, b"", f"{count} bytes dropped unread")

    def _write(
        self, time_s: float, direction: str, state: State, data: bytes, told: str
    ) -> None:
        octets = data.hex(" ").upper()
        self._stream.write(
            f"{time_s:.6f} {direction} {state.name:9} {octets:47} {told}\n"
        )


def _meaning(event: Event) -> str:
    match event:
        case SyncEcho():
            return "attention"
        case ProductId(raw):
            return f"product {readable(raw)}"
        case Reply(query, payload):
            return f"{query.words} = {readable(payload)}"
        case BadReply(query, raw):
            return f"{query.words} answered wrongly: {readable(raw)}"
        case Sample(packet):
            timer = "" if packet.timer is None else f"timer {packet.timer} "
            return f"packet {timer}counts {packet.counts} buttons {packet.buttons:b}"
