"""A force device that nobody has to own: a probe, its motors, and a hand that holds it.

The model is that of the figures in Colgate and Schenkel (1997) and Abbott and Okamura
(2005): a mass with friction, a motor that commands reach late and that saturates, an
encoder that counts. The hand is a spring and a damper from where another input says
that it is.
"""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.haptics.force_port import ForceLimits
from devices.haptics.force_records import HEAD, HEAD_FAULTS, MOST_DELAY
from devices.haptics.kernels.step_head import command_head, lead_head, read_head
from system import UserError

STEP_S = 1e-4
"""Of the simulation: a tenth of a tick."""

LASTS_FOR_EVER_NS = np.iinfo(np.int64).max

UNPLUGGED_S = 1.0
"""An unplugged head comes back after that, where nothing else is said."""

_FAULT = re.compile(
    r"(?P<name>[a-z]+)(?:@(?P<start>\d+\.?\d*)(?:\+(?P<lasts>\d+\.?\d*))?)?"
)

FAULT_FORMS = "NAME[@SECONDS[+DURATION]] with " + ", ".join(HEAD_FAULTS[1:])


@dataclass(frozen=True, slots=True)
class HeadFault:
    """What a head suffers from, since when and how long, seconds."""

    name: str = HEAD_FAULTS[0]
    start_s: float = 0.0
    duration_s: float | None = None

    @classmethod
    def parse(cls, words: str) -> "HeadFault":
        """Read NAME[@SECONDS[+DURATION]]; UserError that tells the names."""
        match = _FAULT.fullmatch(words)
        if match is None or match["name"] not in HEAD_FAULTS[1:]:
            raise UserError(
                f"--haptics-fault must be {FAULT_FORMS}; got {words!r}, where "
                "silent@10+2 would be two seconds of silence after ten."
            )
        lasts = match["lasts"]
        duration = UNPLUGGED_S if match["name"] == "unplugged" else None
        return cls(
            match["name"],
            float(match["start"] or 0.0),
            duration if lasts is None else float(lasts),
        )

    def span_ns(self) -> tuple[int, int]:
        """Return when it begins and ends, ns since the head began."""
        start = round(self.start_s * 1e9)
        if self.duration_s is None:
            return start, LASTS_FOR_EVER_NS
        return start, start + round(self.duration_s * 1e9)


@dataclass(frozen=True, slots=True)
class HeadModel:
    """Describe an emulated head.

    The defaults are a light desktop device in a hand that holds it firmly: with 100 N/m
    and 1 N s/m, as a loose grip is often modelled, friction keeps the probe .5 mm from
    where a mouse points, and it rings for half a second when it is let go.

    mass_kg: of the probe with what it moves. coulomb_n, viscous_ns_m: its friction.
    hand_n_m, hand_ns_m: spring and damper of the hand. limit_n: what its motors can.
    quantum_mm: of its encoders. delay_s: from a command to the motor. watchdog_s: the
    motors stop after so long without a command. measures_hz: how often it measures
    anew, inf for whenever it is asked.
    """

    mass_kg: float = 0.1
    coulomb_n: float = 0.05
    viscous_ns_m: float = 0.5
    hand_n_m: float = 300.0
    hand_ns_m: float = 6.0
    limit_n: float = 3.3
    quantum_mm: float = 0.02
    delay_s: float = 0.0002
    watchdog_s: float = 0.02
    measures_hz: float = np.inf

    def __post_init__(self) -> None:
        """Refuse a model that cannot move."""
        if not (self.mass_kg > 0.0 and self.limit_n > 0.0 and self.hand_n_m > 0.0):
            raise UserError(
                "a head needs a mass, a largest force and a hand, got "
                f"{self.mass_kg} kg, {self.limit_n} N and {self.hand_n_m} N/m"
            )
        if not 0.0 <= self.delay_s < MOST_DELAY * STEP_S:
            raise UserError(
                f"a command may be under way for less than {MOST_DELAY * STEP_S:g} s, "
                f"got {self.delay_s:g}"
            )

    def stiffest_n_m(self, period_s: float) -> float:
        """Return the stiffest wall that is passive at a loop's period.

        ``2 b / (T + 2 d)`` with the probe's own damping b and the delay d (after
        Colgate and Schenkel 1997), for a hand that lets go damps nothing, and no more
        than ``2 f / q``, below which friction f swallows the encoder's steps q (Abbott
        and Okamura 2005).
        """
        stiffest = 2.0 * self.viscous_ns_m / (period_s + 2.0 * self.delay_s)
        if self.quantum_mm > 0.0 and self.coulomb_n > 0.0:
            stiffest = min(stiffest, 2e3 * self.coulomb_n / self.quantum_mm)
        return stiffest


@dataclass(slots=True)
class MockHead:
    """Move as the model does, in the time that `read` is told; a `ForceDevice`.

    `lead` says where the hand goes and may be called by one other thread.
    """

    model: HeadModel = field(default_factory=HeadModel)
    fault: HeadFault = field(default_factory=HeadFault)
    period_s: float = 1e-3
    state: NDArray[Any] = field(init=False)
    """``(1,)`` of `HEAD`."""
    name: str = field(init=False, default="emulated force device")
    limits: ForceLimits = field(init=False)
    read_address: int = field(init=False, default=read_head.address or 0)
    command_address: int = field(init=False, default=command_head.address or 0)
    state_address: int = field(init=False)

    def __post_init__(self) -> None:
        """Put nothing into nobody's hand yet."""
        self.state = state = np.zeros(1, HEAD)
        model = self.model
        for name in (
            *("mass_kg", "coulomb_n", "viscous_ns_m", "hand_n_m", "hand_ns_m"),
            *("limit_n", "quantum_mm"),
        ):
            state[name] = getattr(model, name)
        state["delay_steps"] = round(model.delay_s / STEP_S)
        state["step_ns"] = round(STEP_S * 1e9)
        state["watchdog_ns"] = round(model.watchdog_s * 1e9)
        state["measures_every_ns"] = round(1e9 / model.measures_hz)
        state["fault"] = HEAD_FAULTS.index(self.fault.name)
        state["fault_from_ns"], state["fault_until_ns"] = self.fault.span_ns()
        state["rotation"] = state["to_rotation"] = np.eye(3)
        stiffest = model.stiffest_n_m(self.period_s)
        self.limits = ForceLimits(model.limit_n, stiffest, model.viscous_ns_m)
        self.state_address = int(state.ctypes.data)

    def lead(
        self, device_from_tip: NDArray[np.float64], lasts_s: float, buttons: int = 0
    ) -> None:
        """Let the hand go to a pose, 4x4 mm, and be there after some time."""
        lead_head(
            self.state["goal_number"][0],
            self.state[0],
            np.ascontiguousarray(device_from_tip[:3, 3], np.float64),
            np.ascontiguousarray(device_from_tip[:3, :3], np.float64),
            round(lasts_s * 1e9),
            buttons,
        )

    def close(self) -> None:
        """Let go; there is nothing to let go of."""
