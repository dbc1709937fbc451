"""A stack of slices, as scanners deliver it, on a regular grid.

Scanners tilt their gantry: the table then moves at an angle to the slices' normal and
the stack is sheared. They also change the step on the way. Both are in the slices'
positions; who stacks pixels without looking at them puts structures several
millimetres away from where they are.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume
from system import UserError

SAME_PLACE_MM = 0.01
"""Slices nearer than this are one slice twice. Also the shift and the unevenness, per
slice, that count as rounding in a header."""


@dataclass(frozen=True, slots=True)
class SliceStack:
    """Parallel slices of one size, in any order.

    pixels: ``(n, rows, columns)``. positions_mm: ``(n, 3)`` LPS centre of each slice's
    first pixel. row_direction, column_direction: ``(3,)`` unit vectors along a row
    (rising column) and along a column (rising row). spacing_mm: between columns,
    between rows. thickness_mm: ``(n,)``, NaN where it is not known.
    """

    pixels: NDArray[np.generic]
    positions_mm: NDArray[np.float64]
    row_direction: NDArray[np.float64]
    column_direction: NDArray[np.float64]
    spacing_mm: tuple[float, float]
    thickness_mm: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.pixels.ndim != 3 or len(self.pixels) != len(self.positions_mm):
            raise UserError(
                f"a stack needs one position a slice, got {self.pixels.shape} pixels "
                f"and {len(self.positions_mm)} positions"
            )
        if len(self.pixels) < 2:
            raise UserError("a stack of one slice has no thickness")
        if not np.isfinite(self.positions_mm).all():
            raise UserError("slice positions must be finite")
        lengths = [
            np.linalg.norm(self.row_direction),
            np.linalg.norm(self.column_direction),
        ]
        skew = abs(float(self.row_direction @ self.column_direction))
        if max(abs(length - 1) for length in lengths) > 1e-3 or skew > 1e-3:
            raise UserError(
                f"rows along {self.row_direction} and columns along "
                f"{self.column_direction} are not at right angles"
            )
        if min(self.spacing_mm) <= 0 or not np.isfinite(self.spacing_mm).all():
            raise UserError(f"pixel spacing must be positive, got {self.spacing_mm}")

    @property
    def normal(self) -> NDArray[np.float64]:
        """Return the slices' normal."""
        normal = np.cross(self.row_direction, self.column_direction)
        result: NDArray[np.float64] = normal / np.linalg.norm(normal)
        return result

    def ordered(self) -> "SliceStack":
        """Sort along the normal; UserError when two slices share a place."""
        depth = self.positions_mm @ self.normal
        order = np.argsort(depth, kind="stable")
        gaps = np.diff(depth[order])
        if gaps.min() < SAME_PLACE_MM:
            i = int(gaps.argmin())
            raise UserError(
                f"two slices lie at {depth[order[i]]:.2f} mm: the series holds more "
                "than one image per place (phases or echoes); choose one of them"
            )
        return SliceStack(
            self.pixels[order],
            self.positions_mm[order],
            self.row_direction,
            self.column_direction,
            self.spacing_mm,
            None if self.thickness_mm is None else self.thickness_mm[order],
        )


@dataclass(frozen=True, slots=True)
class StackLayout:
    """How an ordered stack lies: its steps and its shear.

    steps_mm: ``(n - 1,)``. shear_mm: largest sideways shift beyond that of a straight
    stack. tilt_deg: angle between the way of the table and the slices' normal.
    thickness_mm: ``(n,)`` of the slices, NaN where it is not known.
    """

    steps_mm: NDArray[np.float64]
    shear_mm: float
    tilt_deg: float
    thickness_mm: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, stack: SliceStack) -> "StackLayout":
        """Measure an ordered stack."""
        depth = stack.positions_mm @ stack.normal
        way = stack.positions_mm[-1] - stack.positions_mm[0]
        aside = stack.positions_mm - stack.positions_mm[0]
        aside = aside - np.outer(aside @ stack.normal, stack.normal)
        along = float(way @ stack.normal)
        sideways = float(np.linalg.norm(way - along * stack.normal))
        return cls(
            np.diff(depth),
            float(np.linalg.norm(aside, axis=1).max()),
            float(np.degrees(np.arctan2(sideways, along))),
            stack.thickness_mm,
        )

    @property
    def is_regular(self) -> bool:
        """Return whether the pixels can be used as they are."""
        uneven = float(np.abs(self.steps_mm - self.steps_mm.mean()).max())
        return uneven < SAME_PLACE_MM and self.shear_mm < SAME_PLACE_MM

    def missing(self) -> list[tuple[int, int]]:
        """List the gaps that look like lost slices: slice before, how many."""
        return lost_slices(self.steps_mm, self.thickness_mm)


def straighten(stack: SliceStack, background: float) -> Volume:
    """Bring an ordered stack onto a grid with right angles and even steps.

    A regular stack keeps its values. Otherwise each value is interpolated between the
    two slices around it, at the same place in the world: linear fields are kept
    exactly. The step is the smallest there is, but not below the pixels' spacing.
    Where a sheared stack has no pixels `background` stands.
    """
    layout = StackLayout.of(stack)
    normal = stack.normal
    direction = np.stack([stack.row_direction, stack.column_direction, normal], axis=1)
    left, _, right = np.linalg.svd(direction)
    direction = left @ right
    wide, high = stack.spacing_mm
    if layout.is_regular:
        spacing = np.array([wide, high, float(layout.steps_mm.mean())])
        return Volume(
            stack.pixels, spacing, stack.positions_mm[0], direction, background
        )
    step = max(float(layout.steps_mm.min()), min(wide, high))
    local = (stack.positions_mm - stack.positions_mm[0]) @ direction
    depth = local[:, 2]
    count = int(np.floor((depth[-1] - depth[0]) / step + 1e-6)) + 1
    # whole pixels that the first slice is grown by on each side
    shift = local[:, :2] / (wide, high)
    low = np.floor(shift.min(axis=0) + 1e-9).astype(int)
    grown = np.ceil(shift.max(axis=0) - 1e-9).astype(int) - low
    rows, columns = stack.pixels.shape[1:]
    shape = (count, rows + int(grown[1]), columns + int(grown[0]))
    values = np.empty(shape, np.float32)
    # the two slices around a step serve several steps
    moved: dict[int, NDArray[np.float32]] = {}
    for k in range(count):
        at = k * step
        i = min(int(np.searchsorted(depth, at, side="right")) - 1, len(depth) - 2)
        t = (at - depth[i]) / (depth[i + 1] - depth[i])
        moved = {
            n: moved[n]
            if n in moved
            else _shifted(stack.pixels[n], shift[n] - low, shape[1:], background)
            for n in (i, i + 1)
        }
        values[k] = (1 - t) * moved[i] + t * moved[i + 1]
    origin = stack.positions_mm[0] + direction[:, :2] @ (low * (wide, high))
    return Volume(values, np.array([wide, high, step]), origin, direction, background)


def _shifted(
    pixels: NDArray[np.generic],
    shift: NDArray[np.float64],
    shape: tuple[int, int],
    background: float,
) -> NDArray[np.float32]:
    """Move a slice by a part of a pixel onto a larger one."""
    rows, columns = pixels.shape
    right, down = (int(np.floor(s + 1e-9)) for s in shift)
    u, v = max(float(shift[0]) - right, 0.0), max(float(shift[1]) - down, 0.0)
    # the last row and column move beyond their pixel: they are kept to themselves
    padded = np.pad(pixels.astype(np.float32), ((1, 1), (1, 1)), mode="edge")
    across = (1 - u) * padded[:, 1:] + u * padded[:, :-1]
    moved = (1 - v) * across[1:] + v * across[:-1]
    result = np.full(shape, background, np.float32)
    tall = min(rows + (v > 1e-9), shape[0] - down)
    wide = min(columns + (u > 1e-9), shape[1] - right)
    result[down : down + tall, right : right + wide] = moved[:tall, :wide]
    return result


WHOLE_MULTIPLE = 0.03
"""Relative departure from a whole multiple of the section's step that a step may have
to count as missing slices. Steps that an operator chose (4 and 7 mm) are none."""

MOST_DEPARTURE = 0.12
"""Of the section's step; otherwise each hole of 17 slices were a whole multiple."""

AS_THICK = 0.2
"""Relative departure from the steps' ratio at which slices count as thick as they
are far apart: 5 mm below the skull base and 10 mm above lose nothing."""


FEWEST_STEPS = 3
"""Two steps of an uneven stack are multiples by chance."""

MOST_BETWEEN = 3
"""Steps of more thicknesses each are no sign of a step as small as the thickness."""


@dataclass(slots=True)
class _Section:
    """Neighbouring steps that are whole multiples of one."""

    first: int
    steps: list[float] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)

    @property
    def step(self) -> float:
        """Return the one step, averaged over all."""
        return sum(self.steps) / sum(self.counts)

    def takes(self, step: float) -> bool:
        """Add a step if it fits."""
        count = _whole(step, self.step) if self.steps else 1
        if count:
            self.steps.append(step)
            self.counts.append(count)
            return True
        # so far every second slice was missing
        finer = [_whole(held, step) for held in self.steps]
        if not all(finer):
            return False
        self.steps.append(step)
        self.counts = [*finer, 1]
        return True

    def joins(self, other: "_Section") -> bool:
        """Add the section that follows, if the smaller step of both fits all."""
        step = min(self.step, other.step)
        steps = [*self.steps, *other.steps]
        counts = [_whole(held, step) for held in steps]
        if not all(counts):
            return False
        self.steps, self.counts = steps, counts
        return True


def lost_slices(
    steps_mm: NDArray[np.float64], thickness_mm: NDArray[np.float64] | None = None
) -> list[tuple[int, int]]:
    """List the holes of a stack: index of the slice before, how many are lost.

    steps_mm: ``(n - 1,)`` between ordered slices. thickness_mm: ``(n,)`` of the slices,
    None or NaN where it is not known: slices that are thicker where they lie further
    apart were made so, and unequal steps may share one thickness that fits them all.
    """
    thick = np.full(len(steps_mm) + 1, np.nan) if thickness_mm is None else thickness_mm
    found = []
    for section in _sections(steps_mm, thick):
        if len(section.steps) < min(FEWEST_STEPS, len(steps_mm)):
            continue
        counts = np.array(section.counts)
        places = section.first + np.arange(len(counts))
        # as thick as the thicker one of the two slices about each step
        here = np.fmax(thick[places], thick[places + 1])
        single = counts == 1
        base = np.median(here[single] if single.any() else here)
        meant = np.abs(here / base - counts) <= AS_THICK * counts
        found += [
            (int(place), int(count) - 1)
            for place, count, is_meant in zip(places, counts, meant, strict=True)
            if count > 1 and not is_meant
        ]
    return found


def _sections(
    steps_mm: NDArray[np.float64], thick: NDArray[np.float64]
) -> list[_Section]:
    """Part the steps where no common one fits any more."""
    common = float(thick[0])
    is_uneven = np.ptp(steps_mm) > WHOLE_MULTIPLE * steps_mm.min()
    if is_uneven and np.ptp(thick) <= WHOLE_MULTIPLE * common:
        counts = [_whole(float(step), common) for step in steps_mm]
        if all(counts) and min(counts) <= MOST_BETWEEN:
            return [_Section(0, steps_mm.tolist(), counts)]
    found: list[_Section] = []
    for i, step in enumerate(steps_mm.tolist()):
        if not found or not found[-1].takes(step):
            found.append(_Section(i, [step], [1]))
    joined = found[:1]
    for section in found[1:]:
        if not joined[-1].joins(section):
            joined.append(section)
    return joined


def _whole(step: float, base: float) -> int:
    """Return how many times as long a step is; 0 where it is no whole multiple."""
    times = step / base
    count = round(times)
    allowed = min(WHOLE_MULTIPLE * count, MOST_DEPARTURE)
    return count if count >= 1 and abs(times - count) <= allowed else 0
