"""What an emulated arm heard and said, for a person to read.

One line of text each: seconds, direction (``>`` to the arm, ``<`` from it, ``!`` for
what happened to it), the arm's state, the bytes, what they mean.
"""

from typing import TextIO

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.wire.commands import Query
from devices.microscribe.wire.identity import readable

_CONFIGURATION = {query.value: query.words for query in Query} | {
    0xC1: "home reference",
    0xC2: "HOME",
    0xC3: "set home (calibration memory)",
    0xC4: "set baud",
    0xC5: "END",
    0xC7: "set parameters (calibration memory)",
    0xCF: "report on motion",
    0xD0: "set home reference (calibration memory)",
    0xD1: "restore factory (calibration memory)",
    0xD2: "marker",
}
_LISTENING = ("SYNC", "WAIT_BEGIN")
_TEXTS = (AnswerKind.STRING, AnswerKind.PRODUCT_ID, AnswerKind.ATTENTION)


class Transcript:
    """Write every byte of an emulated arm to a text stream."""

    def __init__(self, stream: TextIO) -> None:
        """Write to ``stream``, which stays open and belongs to the caller."""
        self._stream = stream
        self._zero_s: float | None = None

    def heard(self, time_s: float, state: str, data: bytes) -> None:
        """Note bytes from the client and the state in which they found the arm."""
        self._write(time_s, ">", state, data, _meaning_of_heard(state, data))

    def said(
        self, time_s: float, state: str, answer: Answer, left: list[Answer]
    ) -> None:
        """Note an answer, and what faults have made of it."""
        meaning = _meaning_of_said(answer)
        if left != [answer]:
            made = [
                piece.data.hex(" ").upper()
                + (f" {1e3 * piece.delay_s:.1f} ms late" if piece.delay_s else "")
                + (f" then {piece.after.name}" if piece.after else "")
                for piece in left
            ]
            meaning += f"; spoilt: {' | '.join(made) or 'nothing is left'}"
        self._write(time_s, "<", state, answer.data, meaning)

    def happened(self, time_s: float, event: str) -> None:
        """Note what happened to the arm."""
        self._write(time_s, "!", "-", b"", event)

    def _write(
        self, time_s: float, direction: str, state: str, data: bytes, meaning: str
    ) -> None:
        if self._zero_s is None:
            self._zero_s = time_s
        self._stream.write(
            f"{time_s - self._zero_s:12.6f}\t{direction}\t{state}\t"
            f"{data.hex(' ').upper()}\t{meaning}\n"
        )


def _meaning_of_heard(state: str, data: bytes) -> str:
    if state in _LISTENING:
        return f"text {readable(data)}"
    if state in ("ARGUMENTS", "PASSWORD"):
        return state.lower()
    code = data[0]
    if not code & 0x40:
        return f"packet {code & 0x3F:02X}"
    return _CONFIGURATION.get(code | 0x80, "not assigned")


def _meaning_of_said(answer: Answer) -> str:
    kind = answer.kind.name.lower().replace("_", " ")
    if answer.kind in _TEXTS:
        text = answer.data.lstrip(bytes(range(0xC8, 0xCF))).removesuffix(b"\0")
        return f"{kind} {readable(text)}"
    if answer.kind is AnswerKind.PACKET:
        pairs = answer.data[-12:]
        counts = [pairs[i] << 7 | pairs[i + 1] for i in range(0, len(pairs) - 1, 2)]
        suffix = f", counts {counts}" if answer.data[0] & 0b11 == 0b11 else ""
        return f"packet, buttons {answer.data[1]}{suffix}"
    if answer.kind is AnswerKind.ECHO:
        return f"echo of {_CONFIGURATION.get(answer.data[0], 'a command')}"
    return kind
