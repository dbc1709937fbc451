"""What `paravol doctor --device` tells beyond whether an arm is fit to fly with.

Its line, its adapter, its tip and its pedals.
"""

from devices import Pose
from devices.microscribe.wire.commands import POSE_LAYOUT
from devices.microscribe.wire.identity import Maxima
from devices.microscribe.wire.line import BITS_PER_BYTE, LinkTiming
from devices.microscribe.wire.sign_on import RATES
from devices.serial_adapters import LEAST_LATENCY_MS, latency_ms, latency_remedy
from paravol.finding import Finding

FULL_RATE = max(RATES)

FULL_POSES_HZ = 90.0
"""The driver asks for 100 poses a second; a line that keeps up brings nearly all."""

PEDALS = ("right", "left")


def longest_poses_hz(baud: int) -> float:
    """Return how many polled poses a second a line of that rate carries at most."""
    wire_s = (1 + POSE_LAYOUT.length) * BITS_PER_BYTE / baud
    return 1.0 / (wire_s + LinkTiming().latency)


def line_findings(baud: int, round_trip_s: float, rate_hz: float) -> list[Finding]:
    """Return the rate that was found, and the poses a second that it brought.

    ``round_trip_s`` is the median time from a poll to its whole answer.
    """
    wire_s = 1.0 / longest_poses_hz(baud)
    trip = (
        f"{1e3 * round_trip_s:.1f} ms from a poll to its pose; the line and the "
        f"arm need {1e3 * wire_s:.1f} ms"
    )
    poses = f"{rate_hz:.0f} per second"
    return [
        _rate(baud),
        Finding("poses", poses, remedy=_slowness(baud, rate_hz)),
        Finding("round trip", trip),
    ]


def adapter_findings(device: str) -> list[Finding]:
    """Return how long the adapter holds back what it received, where known."""
    timer_ms = latency_ms(device)
    if timer_ms is None:
        return []
    remedy = latency_remedy(device) if timer_ms > LEAST_LATENCY_MS else ""
    return [Finding("adapter", f"latency timer {timer_ms} ms", remedy=remedy)]


def tip_finding(newest: Pose) -> Finding:
    """Return where the tip is, in the arm's own frame."""
    place = " ".join(f"{value:.1f}" for value in newest.tip_mm)
    return Finding("tip", f"{place} mm from the middle of the base, z upwards")


def pedals_finding(maxima: Maxima, pressed: int) -> Finding:
    """Return which pedals the arm has and which of them were pressed (bits)."""
    built_in = [name for bit, name in enumerate(PEDALS) if maxima.buttons >> bit & 1]
    if not built_in:
        return Finding(
            "pedals",
            "the arm states none",
            remedy="Registration and touches need one.",
        )
    seen = [name for bit, name in enumerate(PEDALS) if pressed >> bit & 1]
    unseen = [name for name in built_in if name not in seen]
    told = f"{' and '.join(built_in)}; pressed: {' and '.join(seen) or 'none'}"
    remedy = ""
    if unseen:
        remedy = f"Nothing is known of the {' and '.join(unseen)} one; look again."
    return Finding("pedals", told, remedy=remedy)


def _rate(baud: int) -> Finding:
    if baud >= FULL_RATE:
        return Finding("rate", f"{baud} baud")
    remedy = (
        f"The arm did not answer at {FULL_RATE}. A poll and its pose are "
        f"{1 + POSE_LAYOUT.length} bytes of {BITS_PER_BYTE:g} bits, and the arm thinks "
        f"for 1 ms: {baud} baud carry {longest_poses_hz(baud):.0f} poses per second at "
        f"most, {FULL_RATE} baud {longest_poses_hz(FULL_RATE):.0f}. Switch the arm off "
        "and on, or try another adapter."
    )
    return Finding("rate", f"{baud} baud", remedy=remedy)


def _slowness(baud: int, rate_hz: float) -> str:
    if rate_hz >= FULL_POSES_HZ:
        return ""
    if longest_poses_hz(baud) < FULL_POSES_HZ:
        return f"The line of {baud} baud carries no more."
    return "The adapter or this machine holds answers up."
