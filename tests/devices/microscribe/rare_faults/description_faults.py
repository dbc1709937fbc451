"""Faults F20 to F23: what the arm says about itself."""

import random
from dataclasses import replace

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.faults.fault import Fault, FaultyArm
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.kinematics.profiles import ArmProfile
from disk import UserError

_COMMENT, _FORMAT = 0xCC, 0xCD
_LONG = 40

# Encoders of 16000, 8000 and 4000 counts a turn are known of a USB sibling.
_ODD_ENCODERS = (15999, 15999, 7999, 3999, 3999)


class BadString(Fault):
    """F20."""

    id, word = "f20", "bad_string"
    line = "a string with =NO_NUL, of 40 characters (LONG), NON_ASCII, or EMPTY"
    variants = ("NO_NUL", "LONG", "NON_ASCII", "EMPTY")
    kinds = frozenset((AnswerKind.STRING,))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Break a rule of strings."""
        echo, text = answer.data[:1], answer.data[1:-1]
        body = {
            "NO_NUL": text,
            "LONG": (text + b"x" * _LONG)[:_LONG] + b"\0",
            "NON_ASCII": b"\xe9" + text[1:] + b"\0",
            "EMPTY": b"\0",
        }[self.variant]
        return [replace(answer, data=echo + body)]


class BadParameters(Fault):
    """F21."""

    id, word = "f21", "bad_parameters"
    line = "a parameter block of =0, 35, 37 or 255 bytes, or an unknown FORMAT"
    variants = ("35", "0", "37", "255", "FORMAT")
    lasts = True
    kinds = frozenset((AnswerKind.PARAMETERS, AnswerKind.STRING))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Describe the joints in a way that nobody knows."""
        code = answer.data[0]
        if self.variant == "FORMAT":
            known = answer.kind is not AnswerKind.STRING or code != _FORMAT
            return [answer if known else replace(answer, data=b"\xcdFormat DH9.9\0")]
        if answer.kind is not AnswerKind.PARAMETERS:
            return [answer]
        length = int(self.variant)
        block = (answer.data[2:] + bytes(length))[:length]
        return [replace(answer, data=bytes((code, length)) + block)]


class BadMaxima(Fault):
    """F22."""

    id, word = "f22", "bad_maxima"
    line = "maxima all =ZERO, or encoders that are no power of two (ODD, from power-on)"
    variants = ("ZERO", "ODD")
    lasts = True
    kinds = frozenset((AnswerKind.MAXIMA,))

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        if self.variant == "ODD" and schedule != Schedule():
            raise UserError(
                "f22_bad_maxima=ODD gives the arm other encoders, which it has from "
                "the start; write it without a moment"
            )

    def alter(self, profile: ArmProfile) -> ArmProfile:
        """Return the arm with other encoders, if that is what was asked for."""
        if self.variant != "ODD":
            return profile
        encoders = (*_ODD_ENCODERS, profile.maxima.encoders[5])
        return replace(profile, maxima=replace(profile.maxima, encoders=encoders))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Have no hardware at all, or tell of the other encoders."""
        if self.variant == "ODD":
            # The profile was altered already: what leaves the arm is what it has.
            self.fired += 1
            return [answer]
        return [replace(answer, data=answer.data[:1] + bytes(len(answer.data) - 1))]


class SilentBeta(Fault):
    """F23."""

    id, word = "f23", "silent_beta"
    line = "D3 unanswered though the comment has =BETA, or says STANDARD"
    variants = ("BETA", "STANDARD")
    lasts = True
    kinds = frozenset((AnswerKind.EXTENDED, AnswerKind.STRING))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Keep the second elbow angle to itself."""
        if answer.kind is AnswerKind.EXTENDED:
            return []
        if answer.data[0] == _COMMENT and self.variant == "STANDARD":
            return [replace(answer, data=b"\xccStandard\0")]
        if answer.data[0] == _COMMENT and b"Beta" not in answer.data:
            return [replace(answer, data=b"\xccStandard+Beta\0")]
        return [answer]
