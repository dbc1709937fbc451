"""Faults F13 to F16 and F30: when bytes arrive, and whether."""

import math
from dataclasses import replace

from devices.microscribe.emulator.answer import After, Answer, AnswerKind
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


class Bursts(Fault):
    """F14."""

    id, word = "f14", "bursts"
    line = "bytes are handed over every =MS milliseconds only, as by a USB adapter (16)"
    takes_number = True
    lasts = True

    def arrival_s(self, at_s: float, arm: FaultyArm) -> float:
        """Round up to when the adapter hands over."""
        if not self.trigger.fires(arm.script_s(at_s), arm.packets):
            return at_s
        self.fired += 1
        latency_s = self.number(_ADAPTER_MS) / 1e3
        return math.ceil(at_s / latency_s) * latency_s if latency_s else at_s


class LateReply(Fault):
    """F15."""

    id, word = "f15", "late_reply"
    line = "a packet comes after the reader gave up (=MS late, else 180)"
    takes_number = True
    kinds = frozenset((AnswerKind.PACKET,))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Hold it back."""
        return [replace(answer, delay_s=self.number(_LATE_MS) / 1e3)]


class CutShort(Fault):
    """F16."""

    id, word = "f16", "cut_short"
    line = "in the middle of an answer =UNPLUG, STALL for ever, or REPLUG elsewhere"
    variants = ("UNPLUG", "STALL", "REPLUG")
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Send half of it, then no more."""
        half = answer.data[: (len(answer.data) + 1) // 2]
        return [replace(answer, data=half, after=After[self.variant])]


class Slow(Fault):
    """F30."""

    id, word = "f30", "slow"
    line = "1 to =MS milliseconds (else 30) more before answers; signs on at 9600 only"
    takes_number = True
    lasts = True
    kinds = EVERY_KIND

    def listening_rate(
        self, client_rate: int, arm: FaultyArm, now_s: float
    ) -> int | None:
        """Return the slowest rate."""
        return self.insist_on(_SLOW_RATE, client_rate, arm, now_s)

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Think longer."""
        slowest_ms = max(1.0, self.number(_SLOWEST_MS))
        thought_s = self.noise.uniform(1.0, slowest_ms) / 1e3
        return [replace(answer, delay_s=answer.delay_s + thought_s)]
