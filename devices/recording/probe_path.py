"""Motion of an endoscope with an instrument beside it."""

import math
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from system import UserError

Held = TypeVar("Held")

# Axes rounded to six decimals in a file are at most this far from unit length.
UNIT_TOLERANCE = 1e-5

# Rolls are stored continuous. A larger step means that somebody wrapped them, and
# interpolating across the wrap would spin the picture.
LARGEST_ROLL_STEP_DEG = 90.0


def _nothing() -> NDArray[np.float64]:
    return np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class ProbeSample:
    """State of scope, instrument and pedals at one moment; patient LPS, mm.

    tool: name of the instrument in hand, "" for none, None where the path does not say.
    instrument_roll_deg: its turn about its axis, right-handed about where it points.
    jaw: 0 open to 1 closed. scope_deg: angle of the scope in hand, None for the usual.
    """

    t_s: float
    tip_mm: NDArray[np.float64]
    axis: NDArray[np.float64]
    roll_deg: float
    instrument_tip_mm: NDArray[np.float64]
    instrument_axis: NDArray[np.float64]
    buttons: int
    tool: str | None = None
    instrument_roll_deg: float = 0.0
    jaw: float = 0.0
    scope_deg: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ProbePath:
    """Motion of an endoscope with an instrument beside it; patient LPS, mm.

    Axes are unit vectors from the hand to the tip: the direction in which a straight
    scope looks. ``roll_deg`` turns the scope right-handed about that direction; at
    zero the top of the picture is as near as possible to patient superior (+z). It
    runs on continuously instead of wrapping.
    """

    name: str
    t_s: NDArray[np.float64]
    """(n,) seconds, strictly rising from zero, n >= 2."""
    tip_mm: NDArray[np.float64]
    """(n, 3)"""
    axis: NDArray[np.float64]
    """(n, 3)"""
    roll_deg: NDArray[np.float64]
    """(n,)"""
    instrument_tip_mm: NDArray[np.float64]
    """(n, 3)"""
    instrument_axis: NDArray[np.float64]
    """(n, 3)"""
    buttons: NDArray[np.int64]
    """(n,) 0..127, as a MicroScribe packet carries them: bits 0 and 1 are the arm's
    pedals, bit 2 works the instrument, bit 3 is suction."""
    source: str = field(default="")
    """How the path was made, for a person."""
    tools: tuple[tuple[float, str], ...] = ()
    """Times from which on an instrument is in hand, and its name, "" for none, as it is
    before the first. Without any the path does not say."""
    instrument_roll_deg: NDArray[np.float64] = field(default_factory=_nothing)
    """(n,) its turn, not wrapped; another tool may begin elsewhere. None: 0."""
    jaw: NDArray[np.float64] = field(default_factory=_nothing)
    """(n,) 0 open to 1 closed, beside what the pedal closes; none: 0 throughout."""
    scopes: tuple[tuple[float, float | None], ...] = ()
    """Times from which on a scope of that angle is in hand, None for the usual one."""

    def __post_init__(self) -> None:
        if not self.name:
            raise UserError("a probe path needs a name, got an empty one")
        count = len(self.t_s)
        if count < 2:
            raise UserError(f"a probe path needs at least 2 samples, got {count}")
        for key, width in (("t_s", 0), ("tip_mm", 3), ("axis", 3), ("roll_deg", 0)):
            self._freeze(key, count, width)
        for key in ("instrument_tip_mm", "instrument_axis"):
            self._freeze(key, count, 3)
        self._freeze("buttons", count, 0)
        for key in ("instrument_roll_deg", "jaw"):
            if not len(getattr(self, key)):
                object.__setattr__(self, key, np.zeros(count))
            self._freeze(key, count, 0)
        if self.t_s[0] != 0.0 or (np.diff(self.t_s) <= 0.0).any():
            raise UserError("t_s must rise strictly from 0")
        for key in ("axis", "instrument_axis"):
            length = np.linalg.norm(getattr(self, key), axis=1)
            worst = int(np.argmax(np.abs(length - 1.0)))
            if abs(length[worst] - 1.0) > UNIT_TOLERANCE:
                raise UserError(
                    f"{key} must hold unit vectors, sample {worst} has length "
                    f"{length[worst]:.6g}"
                )
        step = np.abs(np.diff(self.roll_deg))
        if step.max() > LARGEST_ROLL_STEP_DEG:
            raise UserError(
                f"roll_deg must be continuous, it jumps by {step.max():.4g} degrees "
                f"after sample {int(np.argmax(step))}"
            )
        if self.jaw.min() < 0.0 or self.jaw.max() > 1.0:
            raise UserError("jaw must lie in 0..1")
        for key in ("tools", "scopes"):
            changes_s = [time_s for time_s, _ in getattr(self, key)]
            if changes_s != sorted(changes_s) or not all(map(math.isfinite, changes_s)):
                raise UserError(f"{key} must be in order of time, got {changes_s}")
        if self.buttons.min() < 0 or self.buttons.max() > 127:
            raise UserError("buttons must lie in 0..127")

    def _freeze(self, key: str, count: int, width: int) -> None:
        dtype = np.int64 if key == "buttons" else np.float64
        array: NDArray[np.generic] = np.array(getattr(self, key), dtype=dtype)
        shape = (count, width) if width else (count,)
        if array.shape != shape:
            raise UserError(f"{key} must have shape {shape}, got {array.shape}")
        if not np.isfinite(array).all():
            raise UserError(f"{key} must be finite")
        array.flags.writeable = False
        object.__setattr__(self, key, array)

    @property
    def duration_s(self) -> float:
        """Return the time of the last sample."""
        return float(self.t_s[-1])

    @property
    def length_mm(self) -> float:
        """Return the distance that the scope's tip travels."""
        return float(np.linalg.norm(np.diff(self.tip_mm, axis=0), axis=1).sum())

    def sample(self, t_s: float) -> ProbeSample:
        """Return the state at ``t_s``; before and after the path it stands still.

        Positions and roll are interpolated linearly (at 100 Hz and 100 mm/s^2 that
        errs by about 0.001 mm), axes along the great circle; buttons keep the value
        of the last sample.
        """
        if not math.isfinite(t_s):
            raise UserError(f"t_s must be finite, got {t_s}")
        t = min(max(t_s, 0.0), self.duration_s)
        last = len(self.t_s) - 2
        i = min(int(np.searchsorted(self.t_s, t, side="right")) - 1, last)
        start, end = self.t_s[i], self.t_s[i + 1]
        u = float((t - start) / (end - start))
        return ProbeSample(
            t_s=t,
            tip_mm=_lerp(self.tip_mm, i, u),
            axis=slerp(self.axis[i], self.axis[i + 1], u),
            roll_deg=_mix(self.roll_deg, i, u),
            instrument_tip_mm=_lerp(self.instrument_tip_mm, i, u),
            instrument_axis=slerp(
                self.instrument_axis[i], self.instrument_axis[i + 1], u
            ),
            buttons=int(self.buttons[i + 1] if u == 1.0 else self.buttons[i]),
            tool=_last(self.tools, t, "" if self.tools else None),
            instrument_roll_deg=_mix(self.instrument_roll_deg, i, u),
            jaw=_mix(self.jaw, i, u),
            scope_deg=_last(self.scopes, t, None),
        )


def slerp(
    start: NDArray[np.float64], end: NDArray[np.float64], u: float
) -> NDArray[np.float64]:
    """Return the unit vector at fraction ``u`` of the great circle between two.

    Opposite vectors have no single great circle; the result is then ``start``.
    """
    # In plain numbers: numpy takes ten times as long for three of them.
    ax, ay, az = start.tolist()
    bx, by, bz = end.tolist()
    sine = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    if sine < 1e-12:
        p, q = 1.0, 0.0
    else:
        angle = math.atan2(sine, ax * bx + ay * by + az * bz)
        p, q = math.sin((1.0 - u) * angle) / sine, math.sin(u * angle) / sine
    x, y, z = p * ax + q * bx, p * ay + q * by, p * az + q * bz
    length = math.hypot(x, y, z)
    return np.array([x / length, y / length, z / length])


def _lerp(values: NDArray[np.float64], i: int, u: float) -> NDArray[np.float64]:
    mixed: NDArray[np.float64] = (1.0 - u) * values[i] + u * values[i + 1]
    return mixed


def _mix(values: NDArray[np.float64], i: int, u: float) -> float:
    return float((1.0 - u) * values[i] + u * values[i + 1])


def _last(
    changes: tuple[tuple[float, Held], ...], t_s: float, before: Held | None
) -> Held | None:
    """Return what is in hand at a time; before: until the first change."""
    held = [what for time_s, what in changes if time_s <= t_s]
    return held[-1] if held else before
