"""A field as a list of instructions for a stack of rows.

One instruction works on a whole block of points at once, so that its cost is spread
over the block and its loop is turned into vector code; and every instruction treats
each point alone, so that a point's value cannot depend on its block.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from system import UserError


class Op(IntEnum):
    """Name the instructions; the numbers are shared with the kernels."""

    AFFINE = 0
    TABLE = 1
    CHAIN = 2
    ELLIPSOID = 3
    FLAT_TUBE = 4
    SMOOTH_MIN = 5
    SMOOTH_MAX = 6
    ADD = 7
    SUBTRACT = 8
    MULTIPLY = 9
    ABSOLUTE = 10
    NEGATE = 11
    NOISE = 12
    CELLS = 13
    MARK = 14
    WARP = 15
    UNWARP = 16
    SIGNED = 17
    RECALL = 18


class Row(IntEnum):
    """Name the rows of marks that parts leave; the kernels know the same numbers."""

    INFERIOR = 0
    MIDDLE = 1
    SUPERIOR = 2
    UNCINATE = 3
    TORUS = 4
    POLYP = 5
    PHARYNX = 6
    OUTSIDE = 7
    SINUS = 8
    FLUID = 9
    SEPTUM = 10
    SKIN = 11
    REAR = 12
    FACE = 13
    BASE = 14
    FIRST_GROUND = 15


STACK_CHANGE = {
    Op.AFFINE: 1,
    Op.TABLE: 1,
    Op.CHAIN: 1,
    Op.ELLIPSOID: 1,
    Op.FLAT_TUBE: -3,
    Op.SMOOTH_MIN: -1,
    Op.SMOOTH_MAX: -1,
    Op.ADD: -1,
    Op.SUBTRACT: -1,
    Op.MULTIPLY: -1,
    Op.ABSOLUTE: 0,
    Op.NEGATE: 0,
    Op.NOISE: 1,
    Op.CELLS: 1,
    Op.MARK: 0,
    Op.WARP: 0,
    Op.UNWARP: -3,
    Op.SIGNED: 1,
    Op.RECALL: 1,
}


@dataclass(frozen=True, slots=True)
class Program:
    """The instructions and constants of several fields.

    code: ``(n, 4)`` int32 rows of operation, first constant, count, selector.
    constants: ``(m,)`` float32.
    spans: ``(fields, 2)`` int32, each field's first row and the row after its last.
    depth: rows of stack that the deepest field needs.
    """

    code: NDArray[np.int32]
    constants: NDArray[np.float32]
    spans: NDArray[np.int32]
    depth: int


class Encoder:
    """Collect instructions and constants; finish with `program`."""

    def __init__(self) -> None:
        self._code: list[tuple[int, int, int, int]] = []
        self._constants: list[float] = []
        self._spans: list[tuple[int, int]] = []
        self._begun = 0
        self._level = 0
        self._depth = 0

    def emit(
        self, op: Op, constants: list[float], count: int = 0, selector: int = 0
    ) -> None:
        """Append one instruction with its constants."""
        self._code.append((op, len(self._constants), count, selector))
        self._constants.extend(float(c) for c in constants)
        self._level += STACK_CHANGE[op]
        self._depth = max(self._depth, self._level)

    def finish_field(self) -> None:
        """Close the field begun after the previous one."""
        if self._level != 1:
            raise UserError(
                f"a field must leave one row on the stack, it leaves {self._level}"
            )
        self._spans.append((self._begun, len(self._code)))
        self._begun, self._level = len(self._code), 0

    def program(self) -> Program:
        """Return what was collected as arrays."""
        return Program(
            np.array(self._code, dtype=np.int32).reshape(-1, 4),
            np.array([*self._constants, 0.0], dtype=np.float32),
            np.array(self._spans, dtype=np.int32).reshape(-1, 2),
            self._depth,
        )
