"""From what was asked for to an emulated arm that is ready to serve."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.actions import ActionSchedule, parse_action
from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm, LiveMotion
from devices.microscribe.emulator.faults.catalogue import parse_fault
from devices.microscribe.emulator.motion import StillMotion, orbit
from devices.microscribe.emulator.placement import place_arm
from devices.microscribe.emulator.script import ArmScript
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.socket_port import (
    LOOPBACK,
    ServerPort,
    SocketPort,
    parse_address,
)
from devices.microscribe.emulator.terminal_port import TerminalPort, has_terminals
from devices.microscribe.emulator.transcript import Transcript
from devices.microscribe.kinematics.profiles import ArmProfile, profile_named
from devices.recording.probe_path import ProbePath
from system import UserError

MOTIONS = ("orbit", "rest")


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatorSettings(ArmTraits):
    """What an emulated arm is to be; see `paravol emulator --help`."""

    profile: str = "dx40937"
    path: ProbePath | None = None
    fiducials_mm: NDArray[np.float64] | None = None
    """(n, 3), patient LPS; touched in order before the path."""
    motion: str = "orbit"
    """What the arm does without a path."""
    faults: Sequence[str] = ()
    actions: Sequence[str] = ()
    listen: str | None = None
    """PORT or HOST:PORT; a pseudo-terminal without it."""
    link: Path | None = None
    transcript: Path | None = None


@dataclass(frozen=True, slots=True)
class OpenEmulator:
    """An arm at its port."""

    server: EmulatorServer
    device_from_world: NDArray[np.float64] | None
    """Where the arm stands, (4, 4); None when it follows no path."""
    accepts_memory_writes: bool


@contextmanager
def open_emulator(
    options: EmulatorSettings, announce: Callable[[str], None]
) -> Iterator[OpenEmulator]:
    """Make what was asked for; UserError in one sentence for what cannot be.

    ``announce`` is told the port's name whenever it appears.
    """
    profile = profile_named(options.profile)
    faults = tuple(parse_fault(text) for text in options.faults)
    actions = tuple(parse_action(text) for text in options.actions)
    motion, place = _motion(profile, options)
    with ExitStack() as stack:
        log: TextIO | None = None
        if options.transcript is not None:
            log = stack.enter_context(options.transcript.open("w", encoding="utf-8"))
        arm = EmulatedArm(
            profile,
            motion,
            faults=faults,
            traits=options,
            now_s=time.monotonic(),
            transcript=None if log is None else Transcript(log),
        )
        server = EmulatorServer(
            arm,
            _open_port(options),
            actions=ActionSchedule(actions),
            announce=announce,
            idle=None if log is None else log.flush,
        )
        stack.callback(server.close)
        yield OpenEmulator(server, place, options.accepts_memory_writes)


def _open_port(options: EmulatorSettings) -> ServerPort:
    if options.listen is not None:
        if options.link is not None:
            raise UserError("a link can point at a terminal only; leave out --listen")
        return SocketPort(parse_address(options.listen))
    if has_terminals():
        return TerminalPort(options.link)
    if options.link is not None:
        raise UserError(
            "A link can point at a terminal only, and this system has no "
            "pseudo-terminals; leave out --link, and the arm is at a TCP port."
        )
    return SocketPort((LOOPBACK, 0))


def _motion(
    profile: ArmProfile, options: EmulatorSettings
) -> tuple[LiveMotion, NDArray[np.float64] | None]:
    if options.path is not None:
        given = options.fiducials_mm
        fiducials = np.zeros((0, 3)) if given is None else given.reshape(-1, 3)
        place = place_arm(profile, options.path, fiducials, options.seed)
        script = ArmScript(profile, options.path, place, fiducials, options.seed)
        return script, place
    if options.motion not in MOTIONS:
        raise UserError(
            f"motion must be one of {', '.join(MOTIONS)}, got {options.motion!r}"
        )
    still = options.motion == "rest"
    return StillMotion(profile) if still else orbit(profile), None
