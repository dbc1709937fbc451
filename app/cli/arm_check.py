"""Whether an arm is fit to fly with: what `paravol doctor --device` finds.

An encoder that stopped, a line that loses bytes and a clock that runs away show only
while the arm is moved. Missed counts and a joint that counts backwards look like
motion; the error of a registration shows those.
"""

import time
from collections.abc import Callable, Mapping

import numpy as np

from app.cli.arm_findings import (
    adapter_findings,
    line_findings,
    pedals_finding,
    tip_finding,
)
from app.cli.doctor import tell
from app.cli.terminal import Stages
from devices.microscribe import MicroScribe
from devices.microscribe.driver.clock_alignment import LARGEST_DRIFT
from devices.microscribe.driver.encoder_watch import MOVED_COUNTS
from devices.microscribe.driver.sampler import HomeState
from devices.microscribe.kinematics.arm import JOINTS
from devices.microscribe.wire.link import ArmDescription
from paravol.finding import Finding
from paravol.known_constants import constants_findings
from paravol.registration.walk import Guide

LOOK_S = 15.0
"""Encoders and clocks are judged by five seconds and more."""

PATIENCE_S = 5.0

STANDING = 0.5
"""An arm's timer that passes less than this share of the host's time stands still."""


def run_arm_check(
    device: str,
    *,
    as_json: bool,
    look_s: float = LOOK_S,
    accept_constants: bool = False,
) -> int:
    """Look at the arm on a port while it is moved; 1 when it is not fit to fly with.

    ``accept_constants`` keeps the arm's constants though they changed. Raise
    DeviceError when there is none, TimeoutError when it falls silent.
    """
    with Stages() as guide, MicroScribe(device) as arm:
        findings = constants_findings(arm.description, device, accept=accept_constants)
        findings += check_arm(arm, guide, look_s) + adapter_findings(device)
    return tell(f"The arm on {device}", findings, as_json=as_json)


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
    return Finding(
        "arm",
        f"{about.product_name} {about.model}, serial number {about.serial}, "
        f"firmware {about.firmware}",
    )


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
    told = f"{counters['packets']} packets"
    if not faults:
        return Finding("line", f"{told}, no faults")
    return Finding(
        "line",
        f"{told}, {', '.join(faults)}",
        remedy="What was damaged was left out; try another cable or adapter.",
    )


def _clock(drift: float) -> Finding:
    way = "faster" if drift >= 0.0 else "slower"
    told = f"this machine's runs {abs(drift) * 1e6:.0f} ppm {way} than the arm's"
    remedy = ""
    if abs(drift) >= LARGEST_DRIFT:
        remedy = "No quartz is off so far; the line or this machine stalls."
    return Finding("clock", told, remedy=remedy)


def _timer(passed_s: float, host_s: float) -> Finding | None:
    """Return the finding of a timer that stands still, None for one that runs."""
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
    """Return the finding of the encoders: dead, idle (not moved) or all counting.

    Joints are told from 1, the one at the base.
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
