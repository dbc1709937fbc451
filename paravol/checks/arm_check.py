"""Whether an arm is fit to fly with: what `paravol doctor --device` finds.

An encoder that stopped, a line that loses bytes and a clock that runs away show only
while the arm is moved. Missed counts and a joint that counts backwards look like
motion; the error of a registration shows those.
"""

import time
from collections.abc import Callable, Mapping

import numpy as np

from devices import Pose
from devices.microscribe import MicroScribe
from devices.microscribe.driver.clock_alignment import LARGEST_DRIFT
from devices.microscribe.driver.encoder_watch import MOVED_COUNTS
from devices.microscribe.driver.sampler import HomeState
from devices.microscribe.kinematics.arm import JOINTS
from devices.microscribe.wire.commands import POSE_LAYOUT
from devices.microscribe.wire.identity import Maxima
from devices.microscribe.wire.line import BITS_PER_BYTE, LinkTiming
from devices.microscribe.wire.link import ArmDescription
from devices.microscribe.wire.sign_on import RATES
from devices.serial_adapters import LEAST_LATENCY_MS, latency_ms, latency_remedy
from paravol.checks.finding import Finding
from paravol.registration.walk import Guide

PATIENCE_S = 5.0

STANDING = 0.5
"""An arm's timer that passes less than this share of the host's time stands still."""

FULL_RATE = max(RATES)

FULL_POSES_HZ = 90.0
"""The driver asks for 100 poses a second; a line that keeps up brings nearly all."""

PEDALS = ("right", "left")


def check_arm(
    arm: MicroScribe,
    guide: Guide,
    look_s: float,
    now: Callable[[], float] = time.monotonic,
) -> list[Finding]:
    """Let every joint be moved for ``look_s`` of the arm's time; say what was seen.

    ``now`` tells the host's time, seconds, which ends the look at an arm whose own
    stands still.
    """
    guide.say(
        f"For {look_s:g} seconds, turn every joint to and fro by a hand's width, the "
        "stylus about its own axis as well where it has an encoder; press each pedal."
    )
    first = last = arm.read(PATIENCE_S)
    lowest = highest = np.array(arm.counts)
    poses = pressed = 0
    began_s = now()
    passed_s = host_s = 0.0
    while passed_s < look_s and host_s < look_s + PATIENCE_S:
        last = arm.read(PATIENCE_S)
        poses += 1
        pressed |= last.buttons
        lowest = np.minimum(lowest, arm.counts)
        highest = np.maximum(highest, arm.counts)
        passed_s, host_s = last.time_s - first.time_s, now() - began_s
        guide("Moving the joints", min(max(passed_s, host_s) / look_s, 1.0))
    rate_hz = poses / max(passed_s, host_s)
    travel = tuple((highest - lowest).tolist())
    return [
        _about(arm.description),
        _home(arm.home_state),
        *line_findings(arm.baud, arm.round_trip_s, rate_hz),
        tip_finding(last),
        pedals_finding(arm.description.maxima, pressed),
        _line(arm.counters),
        _timer(passed_s, host_s) or _clock(arm.clock_drift),
        _encoders(arm, travel),
    ]


def _about(arm: ArmDescription) -> Finding:
    about = arm.identity
    told = f"{about.product_name} {about.model}, serial number {about.serial}"
    return Finding("arm", f"{told}, firmware {about.firmware}")


def _home(state: HomeState) -> Finding:
    remedy = ""
    if state is not HomeState.HOMED:
        remedy = (
            "Right only when the arm stood in its rest while it was switched on; "
            "otherwise `paravol home --device PORT`."
        )
    return Finding("home position", state.value, remedy=remedy)


def _line(counters: Mapping[str, int]) -> Finding:
    faults = [f"{n} {name}" for name, n in counters.items() if n and name != "packets"]
    told = f"{counters['packets']} packets, {', '.join(faults) or 'no faults'}"
    remedy = "What was damaged was left out; try another cable or adapter."
    return Finding("line", told, remedy=remedy if faults else "")


def _clock(drift: float) -> Finding:
    way = "faster" if drift >= 0.0 else "slower"
    told = f"this machine's runs {abs(drift) * 1e6:.0f} ppm {way} than the arm's"
    remedy = ""
    if abs(drift) >= LARGEST_DRIFT:
        remedy = "No quartz is off so far; the line or this machine stalls."
    return Finding("clock", told, remedy=remedy)


def _timer(passed_s: float, host_s: float) -> Finding | None:
    """Report a timer that stands still, None for one that runs."""
    if passed_s >= STANDING * host_s:
        return None
    return Finding(
        "clock",
        f"the arm's timer stands still: {passed_s:.1f} s of it in {host_s:.1f} s",
        is_missing=True,
        remedy="Poses cannot be told apart in time. Switch the arm off and on; if "
        "the timer does not run then either, it needs the maker's service.",
    )


def _encoders(arm: MicroScribe, travel: tuple[int, ...]) -> Finding:
    """Report dead encoders, without counts while others moved, and idle ones.

    Joints are numbered from 1, the one at the base.
    """
    built_in = [j for j in range(JOINTS) if arm.description.maxima.encoders[j] > 0]
    dead = [j + 1 for j in arm.frozen_joints if travel[j] == 0]
    if dead:
        return Finding(
            "encoders",
            f"no counts from {_listed(dead)}; {_travelled(built_in, travel)}",
            is_missing=True,
            remedy="They stood still while others moved. Move them and look again; an "
            "encoder that then gives no count either needs the maker's service.",
        )
    idle = [j + 1 for j in built_in if travel[j] < MOVED_COUNTS]
    if idle:
        return Finding(
            "encoders",
            f"not moved: {_listed(idle)}; {_travelled(built_in, travel)}",
            remedy="Nothing is known of these joints; move them and look again.",
        )
    return Finding("encoders", f"all count; {_travelled(built_in, travel)}")


def _listed(joints: list[int]) -> str:
    numbers = ", ".join(map(str, joints))
    return f"joint {numbers} (1 is at the base)"


def _travelled(joints: list[int], travel: tuple[int, ...]) -> str:
    return f"travel {' '.join(str(travel[j]) for j in joints)} counts"


def longest_poses_hz(baud: int) -> float:
    """Return how many polled poses a second a line of that rate carries at most."""
    wire_s = (1 + POSE_LAYOUT.length) * BITS_PER_BYTE / baud
    return 1.0 / (wire_s + LinkTiming().latency)


def line_findings(baud: int, round_trip_s: float, rate_hz: float) -> list[Finding]:
    """Return the rate that was found, and the poses a second that it brought.

    round_trip_s: the median time from a poll to its whole answer.
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
    """Report how long the adapter holds back what it received, where that is known."""
    timer_ms = latency_ms(device)
    if timer_ms is None:
        return []
    remedy = latency_remedy(device) if timer_ms > LEAST_LATENCY_MS else ""
    return [Finding("adapter", f"latency timer {timer_ms} ms", remedy=remedy)]


def tip_finding(newest: Pose) -> Finding:
    """Report where the tip is, in the arm's own frame."""
    place = " ".join(f"{value:.1f}" for value in newest.tip_mm)
    return Finding("tip", f"{place} mm from the middle of the base, z upwards")


def pedals_finding(maxima: Maxima, pressed: int) -> Finding:
    """Report which pedals the arm has and which of them were pressed (bits)."""
    built_in = [name for bit, name in enumerate(PEDALS) if maxima.buttons >> bit & 1]
    if not built_in:
        remedy = "Registration and touches need one."
        return Finding("pedals", "the arm states none", remedy=remedy)
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
