"""What the driver does in each of the thirty faults, polled and streaming.

The whole driver but its thread and its serial port runs against the emulated arm; the
clock is moved by the driver's own waiting.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from devices.microscribe.driver.sampler import HomeState, MotionReports
from devices.microscribe.driver.supervisor import ArmSettings, Presence
from devices.microscribe.kinematics.profiles import (
    DX40937,
    G2_UNHOMED,
    ODD_MAXIMA,
    SIX_JOINTS,
    ArmProfile,
)
from devices.microscribe.wire.sign_on import RATES
from devices.port import DeviceError, DeviceReason
from tests.devices.microscribe.rare_faults import EVERY_FAULT

Bench = Any
"""The conftest's Rehearsal."""

POLL = None
STREAM = MotionReports(period_ticks=9)
FAST_STREAM = MotionReports(period_ticks=2)
BOTH = (POLL, STREAM)


@dataclass(frozen=True)
class Row:
    """A fault in its variants, how the arm is read, and what must happen.

    Variants stand between bars; what stands between blanks befalls the same arm.
    """

    faults: str
    check: Callable[[Bench], None]
    reports: tuple[MotionReports | None, ...] = BOTH
    profiles: tuple[ArmProfile, ...] = (DX40937,)


def refusal(
    reason: DeviceReason, rates: tuple[int, ...] = (115200,), within_s: float = 2.0
) -> Callable[[Bench], None]:
    """The session must not open, and that must be known in time."""

    def check(bench: Bench) -> None:
        bench.refused(reason, rates)
        assert bench.line.clock.now() < within_s
        assert bench.written[-1] == b"\xc5"

    return check


def connects(bench: Bench) -> None:
    supervisor = bench.connect(ArmSettings(rates=RATES, reports=bench.reports))
    assert supervisor.link.baud == bench.line.arm.session_rate
    bench.steady(bench.run(supervisor, 3.0))
    assert supervisor.sampler.missed == supervisor.link.session.stray == 0


def wrong_bytes(bench: Bench) -> None:
    """One packet in ten is spoilt and none of these becomes a pose."""
    supervisor = bench.connect()
    poses = bench.run(supervisor, 5.0)
    bench.steady(poses)
    seen = supervisor.link.session
    told = seen.stray + seen.counters.framing + seen.counters.noise
    assert told + supervisor.sampler.missed >= 16
    # Polled, a lost reply costs its timeout and the settling; streamed, two packets.
    gaps_s = np.diff([pose.time_s for pose in poses])
    assert gaps_s.max() < (0.2 if bench.reports is POLL else 0.035)


def f10_flipped_bit(bench: Bench) -> None:
    supervisor = bench.connect()
    poses = bench.run(supervisor, 20.0)
    fired = bench.line.arm.fired["f10_flipped_bit"]
    off = np.array(bench.off_mm(poses))
    tracker = supervisor.sampler.tracker
    assert tracker.refused > fired / 5
    assert tracker.jumps == 0
    # What passes is less than a hand could move in the time between two samples.
    assert off.max() < np.radians(7.3) * 656.0
    assert (off > 5.0).sum() < fired / 6
    times = [pose.time_s for pose in poses]
    assert (np.diff(times) > 0.0).all()
    assert times[-1] == pytest.approx(bench.line.clock.now(), abs=0.05)


def f14_bursts(bench: Bench) -> None:
    supervisor = bench.connect()
    poses = bench.run(supervisor, 10.0)
    bench.steady(poses)
    assert supervisor.sampler.missed == 0
    ticks = np.round(np.diff([pose.time_s for pose in poses]) * 900.0)
    late = np.array([pose.host_time_s - pose.time_s for pose in poses[400:]])
    if bench.reports is not POLL:
        # None is lost, and the adapter's 16 ms are not in the times.
        assert set(ticks) <= {1.0, 2.0, 3.0}
        assert late.max() - late.min() < 0.003


def f15_late_reply(bench: Bench) -> None:
    supervisor = bench.connect()
    bench.run(supervisor, 1.0)
    poses = bench.run(supervisor, 3.0)
    assert bench.line.arm.fired["f15_late_reply"] == 1
    bench.steady(poses)
    # No pose is older than its own way: a late reply is nobody's.
    if bench.reports is POLL:
        late = [pose.host_time_s - pose.time_s for pose in poses]
        assert max(late) - min(late) < 0.01
        assert supervisor.sampler.missed >= 1


def f16_cut_short(bench: Bench) -> None:
    if "REPLUG" not in bench.fault:
        supervisor = bench.connect()
        with pytest.raises(DeviceError) as caught:
            bench.run(supervisor, 10.0)
        assert caught.value.reason is DeviceReason.DISCONNECTED
        return
    supervisor = bench.connect(replug=True)
    before = bench.run(supervisor, 4.0)
    after = bench.run(supervisor, 2.0)
    assert supervisor.presence is Presence.THERE
    assert supervisor.losses == 1
    assert supervisor.port.name == "memory:2"
    assert supervisor.sampler.home_state is HomeState.ASSUMED
    bench.steady(before + after)


def f17_power_cycle(bench: Bench) -> None:
    supervisor = bench.connect()
    before = bench.run(supervisor, 1.9)
    assert bench.run(supervisor, 0.5)
    assert bench.run(supervisor, 3.0) == []
    states = [supervisor.sampler.home_state]
    assert supervisor.home()
    after = bench.run(supervisor, 1.0)
    states.append(supervisor.sampler.home_state)
    assert states == [HomeState.UNKNOWN, HomeState.HOMED]
    assert after[0].time_s > before[-1].time_s


def f18_encoder_wrap(bench: Bench) -> None:
    supervisor = bench.connect()
    tracker = supervisor.sampler.tracker
    reached: list[tuple[int, ...]] = []
    for _ in range(1500):
        bench.run(supervisor, 0.02)
        reached.append(tracker.counts)
    counts = np.array(reached)[:, np.array(tracker.encoders.turn) > 1]
    assert np.abs(np.diff(counts, axis=0)).max() < 200
    assert (np.ptp(counts, axis=0) > 32000).all()
    assert (tracker.refused, tracker.jumps) == (0, 0)
    # Angles as continuous as the counts: the tip never leaps.
    tips = np.array([pose.tip_mm for pose in bench.poses])
    rate = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert rate.max() < 200.0


def f19_timer_wrap(bench: Bench) -> None:
    supervisor = bench.connect(replug=True)
    poses = bench.run(supervisor, 60.0)
    if supervisor.losses:
        # Twenty seconds of silence may have been a power cut.
        assert supervisor.sampler.home_state is HomeState.UNKNOWN
        supervisor.home()
        poses += bench.run(supervisor, 5.0)
    assert max(bench.off_mm(poses)) < 1e-9
    times = np.array([pose.time_s for pose in poses])
    assert (np.diff(times) > 0.0).all()
    host = np.array([pose.host_time_s for pose in poses])
    assert (np.diff(host) >= 0.0).all()
    assert np.ptp(times) == pytest.approx(np.ptp(host), abs=0.1)


def f22_bad_maxima(bench: Bench) -> None:
    if "ZERO" in bench.fault:
        refusal(DeviceReason.UNSUPPORTED_FORMAT)(bench)
        return
    supervisor = bench.connect()
    assert supervisor.sampler.description.encoders.turn[:2] == (16000, 16000)
    bench.steady(bench.run(supervisor, 0.5))


def f23_silent_beta(bench: Bench) -> None:
    if "BETA" in bench.fault:
        error = bench.refused(DeviceReason.BAD_REPLY, (115200,))
        assert "second elbow angle (BETA)" in str(error)
        return
    assert bench.connect().sampler.description.geometry.beta == 0.0
    assert b"\xd3" not in bench.written


def f24_unhomed(bench: Bench) -> None:
    supervisor = bench.connect()
    with pytest.raises(DeviceError) as caught:
        bench.run(supervisor, 10.0)
    assert caught.value.reason is DeviceReason.NOT_HOMED
    supervisor = bench.connect(replug=True)
    assert bench.run(supervisor, 5.0) == []
    assert supervisor.losses > 0
    bench.line.arm.press_home_button(bench.line.clock.now())
    assert bench.run(supervisor, 12.0)


def f25_pedals(bench: Bench) -> None:
    supervisor = bench.connect()
    poses = bench.run(supervisor, 3.0)
    supervisor.close()
    assert max(bench.off_mm(poses)) < 1e-9
    levels = [pose.buttons for pose in poses]
    # Levels pass as they are; both pedals come in one packet.
    pressed = {"BOTH": 3, "BOUNCE": 1}.get(bench.fault[4:-2], 0)
    assert set(levels) == {0, pressed}
    assert pressed == 0 or 20 < levels.count(pressed) < 150


def f26_stream_goes_on(bench: Bench) -> None:
    supervisor = bench.connect()
    bench.run(supervisor, 1.0)
    began = bench.line.clock.now()
    if "=9" in bench.fault:
        with pytest.raises(DeviceError, match="goes on reporting") as caught:
            supervisor.home()
        assert caught.value.reason is DeviceReason.BAD_REPLY
        assert bench.line.clock.now() - began < 2.0
        return
    assert supervisor.home()
    assert bench.line.clock.now() - began < 1.0
    bench.motion.homed = 0
    bench.steady(bench.run(supervisor, 1.0))


def f27_sick_encoder(bench: Bench) -> None:
    supervisor = bench.connect()
    poses = bench.run(supervisor, 4.0)
    assert supervisor.sampler.tracker.watch.frozen == ()
    poses += bench.run(supervisor, 4.0)
    dead = "DEAD" in bench.fault
    assert supervisor.sampler.tracker.watch.frozen == ((2,) if dead else ())
    # A diagnosis and no more: poses go on.
    assert len(poses) > 500
    assert supervisor.sampler.tracker.refused == 0


def f29_memory_write(bench: Bench) -> None:
    supervisor = bench.connect()
    poses = bench.run(supervisor, 4.0)
    bench.steady(poses)
    # It was somebody else, and was refused.
    assert bench.line.arm.firmware.memory_writes == 1
    assert poses[-1].time_s > 3.9


def f30_slow(bench: Bench) -> None:
    supervisor = bench.connect(ArmSettings(rates=RATES, reports=bench.reports))
    assert supervisor.link.baud == 9600
    poses = bench.run(supervisor, 10.0)
    assert max(bench.off_mm(poses)) < 1e-9
    assert len(poses) > 150
    assert (supervisor.sampler.missed, supervisor.sampler.recoveries) == (0, 0)


R = DeviceReason
NO_FORMAT, BAD_REPLY = refusal(R.UNSUPPORTED_FORMAT), refusal(R.BAD_REPLY)
SEVEN = " | ".join(f"f2={rate}" for rate in RATES)
# One packet in ten is hit, each at another byte.
EVERY_BYTE = " ".join(f"{{0}}={at}@packet:{20 + 10 * at}" for at in range(16))
SIXTEEN = " ".join(f"{{0}}@packet:{20 + 10 * i}" for i in range(16))
TOP_BITS = " | ".join(SIXTEEN.format(f"f11={k}") for k in ("PAYLOAD", "HEADER"))
NOISE = " | ".join(SIXTEEN.format(f"f12={k}") for k in ("MIXED", "LOW", "HIGH"))
ANY_ARM = (DX40937, SIX_JOINTS, ODD_MAXIMA)

ROWS: dict[str, Row] = {
    "f1": Row("f1", refusal(R.NO_DEVICE, RATES, 2 * 7 * 1.1)),
    "f2": Row(SEVEN, connects),
    "f3": Row("f3=1 | f3=2 | f3=5 | f3=20", connects),
    "f4": Row("f4", connects),
    "f5": Row("f5", refusal(R.CANT_BEGIN, within_s=8.0)),
    "f6": Row("f6=IBOX | f6=XXXX | f6=EMPTY", refusal(R.WRONG_DEVICE)),
    "f7": Row("f7=RUN | f7=MOTION | f7=ARGS | f7=PASSWORD", connects),
    "f8": Row(EVERY_BYTE.format("f8"), wrong_bytes),
    "f9": Row(EVERY_BYTE.format("f9"), wrong_bytes),
    "f10": Row("f10@p:0.03", f10_flipped_bit),
    "f11": Row(TOP_BITS, wrong_bytes),
    "f12": Row(NOISE, wrong_bytes),
    "f13": Row("f13=4@0.1 | f13=0@0.1", connects),
    "f14": Row("f14", f14_bursts, (POLL, FAST_STREAM)),
    "f15": Row("f15@2", f15_late_reply),
    "f16": Row("f16=UNPLUG@2 | f16=STALL@2 | f16=REPLUG@2", f16_cut_short),
    "f17": Row("f17@2", f17_power_cycle),
    "f18": Row("f18@0.1", f18_encoder_wrap, BOTH, ANY_ARM),
    "f19": Row("f19=WRAP@2 | f19=PAUSE@2", f19_timer_wrap),
    "f20": Row("f20=NO_NUL | f20=LONG | f20=NON_ASCII | f20=EMPTY", BAD_REPLY),
    "f21": Row("f21=0 | f21=35 | f21=37 | f21=255 | f21=FORMAT", NO_FORMAT),
    "f22": Row("f22=ZERO | f22=ODD", f22_bad_maxima),
    "f23": Row("f23=BETA | f23=STANDARD", f23_silent_beta),
    "f24": Row("f24", f24_unhomed, BOTH, (DX40937, G2_UNHOMED)),
    "f25": Row("f25=BOUNCE@1 | f25=BOTH@1 | f25=STOPS@1", f25_pedals),
    "f26": Row("f26=1 | f26=2 | f26=9", f26_stream_goes_on, (STREAM,)),
    "f27": Row("f27=DEAD2 | f27=MISSED2 | f27=BACKWARDS2", f27_sick_encoder),
    "f28": Row("f28", refusal(R.LOOPBACK)),
    "f29": Row("f29@2", f29_memory_write),
    "f30": Row("f30", f30_slow),
}

CASES = [
    pytest.param(row, fault, reports, profile, id=f"{fault[:12]} {way} {profile_name}")
    for row in ROWS.values()
    for fault in row.faults.split(" | ")
    for reports, way in (
        (r, "polled" if r is POLL else "streamed") for r in row.reports
    )
    for profile, profile_name in ((p, p.identity.serial) for p in row.profiles)
]


@pytest.mark.parametrize(("row", "fault", "reports", "profile"), CASES)
def test_the_driver_in_every_fault(
    rehearse: Callable[..., Bench],
    row: Row,
    fault: str,
    reports: MotionReports | None,
    profile: ArmProfile,
) -> None:
    moving = row.check is f27_sick_encoder
    bench = rehearse(*fault.split(), profile=profile, reports=reports, waving=moving)
    row.check(bench)


def test_the_table_has_a_row_for_each_of_the_thirty() -> None:
    assert list(ROWS) == [f"f{i}" for i in range(1, 31)]
    assert set(ROWS) == {kind.id for kind in EVERY_FAULT} - {"garbage"}
    for row in ROWS.values():
        assert row.faults
