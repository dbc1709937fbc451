"""Fault F13: when bytes arrive."""

from dataclasses import replace

from devices.microscribe.emulator.answer import Answer
from devices.microscribe.emulator.faults.fault import EVERY_KIND, Fault, FaultyArm

_LONGEST_GAP_MS = 50.0
_ADAPTER_MS = 16.0
# Past a reader's usual 100 ms and the 50 ms in which it lets the line settle: the
# answer comes while the next one is awaited.
_LATE_MS = 180.0
_SLOWEST_MS = 30.0
_SLOW_RATE = 9600


class Chunks(Fault):
    """F13."""

    id, word = "f13", "chunks"
    wire_order = 3
    line = "answers come in pieces, with gaps of 0 to =MS milliseconds (else 50)"
    takes_number = True
    lasts = True
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Cut it up; the gaps together are no longer than one may be."""
        longest_s = self.number(_LONGEST_GAP_MS) / 1e3
        pieces: list[Answer] = []
        at, left_s = 0, longest_s
        while at < len(answer.data):
            size = self.noise.choice((1, 1, 2, 5))
            gap_s = self.noise.uniform(0.0, left_s)
            left_s -= gap_s
            piece = answer.data[at : at + size]
            pieces.append(replace(answer, data=piece, delay_s=gap_s, after=None))
            at += size
        if not pieces:
            return [answer]
        first, last = pieces[0], pieces[-1]
        pieces[0] = replace(first, delay_s=first.delay_s + answer.delay_s)
        pieces[-1] = replace(pieces[-1], after=answer.after) if last else last
        return pieces
