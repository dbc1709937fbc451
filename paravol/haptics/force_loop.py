"""The force loop's thread: started with a device, ended with it, asked by others."""

import sys
import threading
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from anatomy.wall_layers import WallLayers
from devices.haptics.force_port import ForceDevice, ForceLimits, new_guard
from devices.haptics.force_records import AWAY, FAULT_TEXTS, NO_FAULT, READING
from devices.port import Closing
from paravol.haptics.kernels.c_functions import COMMAND, READ, CFunction
from paravol.haptics.kernels.publishing import count_one
from paravol.haptics.kernels.run_loop import Feeling, Tissue, copy_state, run_loop
from paravol.haptics.loop_record import BIN_NS, LOOP
from scenarios.session import SHAFT_CHECKED_MM
from surgery import solids
from surgery.force import balls_of, feel_tables
from surgery.kernels import touch_force
from system import UserError, be_punctual

Doubles = NDArray[np.float64]

PERIOD_S = 1e-3

REALTIME_PRIORITY = 1
"""Before all that has none, behind whatever else asked for some."""


@dataclass(frozen=True, slots=True)
class DeviceState:
    """Where the device is and what it was told, in the newest tick.

    device_from_tip: 4x4 mm. count: of its measurements. force_n: ``(3,)``, device
    frame. fault: of `devices.haptics.force_records`.
    """

    device_from_tip: Doubles
    count: int
    buttons: int
    force_n: Doubles
    fault: int

    @property
    def is_measured(self) -> bool:
        """Return whether the pose is the device's, measured just now."""
        return self.fault == NO_FAULT and self.count > 0

    @property
    def is_away(self) -> bool:
        """Return whether the device is not there."""
        return self.fault == AWAY


@dataclass(frozen=True, slots=True)
class LoopFigures:
    """Tell how the loop ran.

    late_us: 50th, 99th and 99.9th percentile, in steps of 10 us. missed: ticks that
    were left out. share: of a core. tick_us, dearest_us: mean and dearest tick. faults:
    what the guard stopped, by name, and how often.
    """

    ticks: int
    missed: int
    late_us: tuple[float, float, float]
    share: float
    tick_us: float
    dearest_us: float
    faults: dict[str, int]

    def lines(self) -> list[str]:
        """Return this for a terminal."""
        p50, p99, p999 = self.late_us
        told = (
            f"Force loop: {self.ticks:,} ticks, {self.missed:,} missed; late by "
            f"{p50:g} / {p99:g} / {p999:g} us (50, 99, 99.9 %); a tick takes "
            f"{self.tick_us:.0f} us, {100 * self.share:.1f} % of a core."
        )
        stopped = ", ".join(f"{text}: {n}" for text, n in self.faults.items())
        return [told, *([f"No force was given because {stopped}."] if stopped else [])]


def new_feeling(
    layers: WallLayers, balls: Doubles, limits: ForceLimits, period_s: float
) -> Feeling:
    """Return what a tick works with, for a tool of balls ``(n, 4)`` on a device."""
    walls, grounds = feel_tables(layers)
    settings = np.zeros(touch_force.SETTINGS)
    settings[touch_force.PERIOD] = period_s
    settings[touch_force.STIFFEST] = limits.stiffest_n_m(period_s) * 1e-3
    settings[touch_force.DAMPING] = limits.damping_ns_m * 1e-3
    settings[touch_force.MOST_N] = limits.force_n
    return Feeling(
        walls,
        grounds,
        np.ascontiguousarray(balls, np.float64),
        settings,
        np.zeros(touch_force.STATE),
        np.zeros(touch_force.HOLES),
        np.zeros((len(balls) + touch_force.BEHIND, touch_force.WORK)),
        np.zeros(touch_force.OUT),
    )


def scope_balls(radius_mm: float) -> Doubles:
    """Return the balls ``(n, 4)`` of a scope's shaft, its round front at the tip."""
    begin, end = (0.0, 0.0, radius_mm), (0.0, 0.0, SHAFT_CHECKED_MM)
    balls, _ = balls_of([solids.capsule(begin, end, radius_mm)])
    return balls


class LoopArguments(NamedTuple):
    """What `paravol.haptics.kernels.run_loop` takes, in its order."""

    read: CFunction
    command: CFunction
    device: int
    reading: NDArray[Any]
    guard: NDArray[Any]
    loop: NDArray[Any]
    tissue: Tissue
    feeling: Feeling


def loop_arguments(
    device: ForceDevice, tissue: Tissue, feeling: Feeling, period_s: float
) -> LoopArguments:
    """Return the arguments of a loop that has not begun, nothing placed yet."""
    loop = np.zeros(1, LOOP)
    loop["period_ns"] = round(period_s * 1e9)
    return LoopArguments(
        CFunction(device.read_address, READ),
        CFunction(device.command_address, COMMAND),
        device.state_address,
        np.zeros(1, READING),
        new_guard(device.limits),
        loop,
        tissue,
        feeling,
    )


class ForceLoop(Closing):
    """Run the loop from its making to `close`, in a thread without the interpreter.

    The device belongs to the loop until it is closed. Forces begin with `place`.
    """

    def __init__(
        self,
        device: ForceDevice,
        tissue: Tissue,
        feeling: Feeling,
        period_s: float = PERIOD_S,
    ) -> None:
        """Compile what is not compiled yet, which may take half a minute, and begin.

        UserError where this system has no clock to sleep by.
        """
        if sys.platform != "linux":
            raise UserError(
                "The force loop sleeps by a clock of Linux; on this system fly with "
                "--haptics none."
            )
        self._device = device
        self._arguments = loop_arguments(device, tissue, feeling, period_s)
        self._guard, self._loop = self._arguments.guard, self._arguments.loop
        stop = self._loop["stop"][0]
        # told to stop before it begins, it does nothing but be compiled
        stop[0] = 1
        run_loop(*self._arguments)
        stop[0] = 0
        # Daemonic: a forgotten loop must not keep the interpreter.
        self._thread = threading.Thread(target=self._run, name="force loop")
        self._thread.daemon = True
        self._thread.start()

    def place(self, world_from_device: Doubles) -> None:
        """Say where the device lies in the patient, 4x4; forces grow from now on."""
        self._loop["world_from_device"][0] = world_from_device[:3]
        count_one(self._loop["is_placed"][0])

    @property
    def state(self) -> DeviceState:
        """Return the newest state, all of one tick."""
        copy = np.zeros(1, LOOP)
        copy_state(self._loop, copy)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = copy["rotation"][0], copy["position_mm"][0]
        return DeviceState(
            pose,
            int(copy["count"][0]),
            int(copy["buttons"][0]),
            copy["force_n"][0].copy(),
            int(copy["fault"][0]),
        )

    def figures(self) -> LoopFigures:
        """Return how the loop ran so far."""
        loop = self._loop[0]
        ticks = int(loop["ticks"])
        sums = np.cumsum(loop["late"])
        late = tuple(
            float(np.searchsorted(sums, share * sums[-1]) + 1) * BIN_NS * 1e-3
            for share in (0.5, 0.99, 0.999)
        )
        passed_ns = (ticks + int(loop["missed"])) * int(loop["period_ns"])
        counts = self._guard["faults"][0].tolist()
        return LoopFigures(
            ticks,
            int(loop["missed"]),
            (late[0], late[1], late[2]),
            float(loop["cpu_ns"]) / max(passed_ns, 1),
            1e-3 * float(loop["cost_ns"]) / max(ticks, 1),
            1e-3 * float(loop["dearest_ns"]),
            {t: n for t, n in zip(FAULT_TEXTS, counts, strict=True) if n},
        )

    def close(self) -> None:
        """End the loop, then let go of the device; harmless when repeated."""
        count_one(self._loop["stop"][0])
        self._thread.join()
        self._device.close()

    def _run(self) -> None:
        # where it is not granted the loop is later, not wrong
        be_punctual(REALTIME_PRIORITY)
        run_loop(*self._arguments)
