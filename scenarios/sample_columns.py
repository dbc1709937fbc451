"""Many samples at once: an array for each thing that was measured."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.bundle.records import SampleRecord
from scenarios.instrument_state import NO_TOOL
from scenarios.sample import Sample
from system import UserError

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SampleColumns:
    """Samples as columns; see `scenarios.sample.Sample`.

    time_s, roll_deg, camera_deg, tool_roll_deg: ``(n,)``. scope_deg: ``(n,)``, NaN for
    the exercise's own scope. device_from_tip: ``(n, 4, 4)``. tool_mm, tool_pointing:
    ``(n, 3)``. tool: ``(n,)`` places in `names`. is_used: ``(n,)``, the tool works or
    sucks. is_frozen: ``(n,)``. undone: strokes that were taken back in all.
    """

    time_s: Doubles
    device_from_tip: Doubles
    roll_deg: Doubles
    camera_deg: Doubles
    scope_deg: Doubles
    tool_mm: Doubles
    tool_pointing: Doubles
    tool_roll_deg: Doubles
    tool: NDArray[np.int64]
    names: tuple[str, ...]
    is_used: NDArray[np.bool_]
    is_frozen: NDArray[np.bool_]
    undone: int = 0

    @classmethod
    def of(cls, samples: Sequence[Sample] | Sequence[SampleRecord]) -> "SampleColumns":
        """Take samples, or their records, in order; UserError for a pose that is none.

        Of thousands of records this takes a fifth of the time of their samples.
        """
        held = [sample.instrument for sample in samples]
        names: dict[str, int] = {}
        tool = [names.setdefault(state.name, len(names)) for state in held]
        return cls(
            np.array([sample.time_s for sample in samples], np.float64),
            _rows([s.device_from_tip for s in samples], 4, 4),
            np.array([sample.roll_deg for sample in samples], np.float64),
            np.array([sample.camera_roll_deg for sample in samples], np.float64),
            # what is None becomes NaN
            np.array([sample.scope_deg for sample in samples], np.float64),
            _rows([sample.instrument_tip_mm for sample in samples], 3),
            _rows([sample.instrument_pointing for sample in samples], 3),
            np.array([state.roll_deg for state in held], np.float64),
            np.array(tool, np.int64),
            tuple(names),
            np.array([s.is_working or s.is_sucking for s in held], np.bool_),
            np.array([sample.is_frozen for sample in samples], np.bool_),
            max((state.undone for state in held), default=0),
        )

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def is_held(self) -> NDArray[np.bool_]:
        """Return in which samples the second hand holds a tool, ``(n,)``."""
        empty = self.names.index(NO_TOOL) if NO_TOOL in self.names else -1
        held: NDArray[np.bool_] = self.tool != empty
        return held


def _rows(values: Sequence[object], *shape: int) -> Doubles:
    try:
        # what there is not is None in a record, and becomes NaN
        rows: Doubles = np.array(values, np.float64).reshape(len(values), *shape)
    except ValueError as error:
        count = int(np.prod(shape))
        what = "a pose" if count == 16 else "a place"
        raise UserError(
            f"{what} of the recording has not {count} numbers; its stream was changed."
        ) from error
    return rows
