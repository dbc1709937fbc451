"""One head: its parts, in the order in which they are united, as kernel tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.bricks import kernels
from anatomy.honeycomb import Mark
from anatomy.noise import noise_tables
from anatomy.nose import Row
from anatomy.parameters import PhantomParameters
from anatomy.parts import Part, side_parts
from anatomy.program import Encoder
from anatomy.shapes import Field, smooth_min
from anatomy.surroundings import Solid, common_marks, solids
from anatomy.tissue import TISSUES, Side

BAND_MM = 3.0
"""Where the model is evaluated: this far outside the air; deeper, only that it is."""


@dataclass(frozen=True, slots=True)
class Model:
    """Hold the parts, the surroundings and the kernel tables of one head."""

    parameters: PhantomParameters
    parts: tuple[Part, ...]
    surroundings: tuple[Solid, ...]
    tables: kernels.Tables
    stack_depth: int
    mark_rows: int


def build_model(parameters: PhantomParameters) -> Model:
    """Build the head that `parameters` describe."""
    parts = (*side_parts(parameters, Side.RIGHT), *side_parts(parameters, Side.LEFT))
    # Ducts come last: then the opposite face of a wall is known before they join in.
    parts = tuple(sorted(parts, key=lambda part: part.cavity == 0))
    painted = solids(parameters)
    encoder = Encoder()
    for part in parts:
        part.field.encode(encoder)
        encoder.finish_field()
    rows: list[int] = []
    marks: list[Field] = [Mark(row, field) for row, field in common_marks()]
    for solid in painted:
        if isinstance(solid.field, Row):
            rows.append(int(solid.field))
        else:
            rows.append(Row.FIRST_GROUND + len(marks))
            marks.append(Mark(rows[-1], solid.field))
    smooth_min(0.0, *marks).encode(encoder)
    encoder.finish_field()
    program = encoder.program()
    octaves, limits, permutation, gradients = noise_tables(
        parameters.seed, parameters.unevenness
    )
    bend = 1 + 0.1 * abs(parameters.septal_deviation_mm)
    tables = kernels.Tables(
        code=program.code,
        constants=program.constants,
        parts=np.array(
            [
                [*span, 1 if p.side == Side.RIGHT else -1, p.cavity]
                for span, p in zip(program.spans, parts, strict=False)
            ],
            dtype=np.int32,
        ),
        reach=np.array(
            [[p.steepness * bend, p.noise_mm] for p in parts], dtype=np.float32
        ),
        common=program.spans[-1].copy(),
        septum=np.array(
            [parameters.septal_deviation_mm, -22, 1 / 14, 16, 1 / 12], dtype=np.float32
        ),
        octaves=octaves,
        limits=limits,
        perm=permutation,
        grad=gradients,
        tint=_tint_table(),
        solids=np.array(
            [
                [row, s.half_thickness_mm, s.hu, s.label, s.level_mm]
                for row, s in zip(rows, painted, strict=True)
            ],
            dtype=np.float32,
        ),
    )
    return Model(
        parameters,
        parts,
        tuple(painted),
        tables,
        program.depth,
        Row.FIRST_GROUND + len(marks),
    )


def _tint_table() -> NDArray[np.float32]:
    """List mark row, centre mm, half width mm, blood fraction; later rows win.

    Half widths keep centre + half width inside the band: a part that was left out
    cannot have been needed.
    """
    rows = [
        (Row.SEPTUM, 0.6, 1.2, "septum"),
        (Row.INFERIOR, 1.0, 1.2, "inferior turbinate"),
        (Row.MIDDLE, 1.0, 1.2, "middle turbinate"),
        (Row.SUPERIOR, 1.0, 1.2, "superior turbinate"),
        (Row.UNCINATE, 1.0, 1.2, "uncinate"),
        (Row.TORUS, 1.0, 1.2, "torus"),
        (Row.SINUS, 1.3, 1.4, "sinus lining"),
        (Row.REAR, 0.0, 3.0, "nasopharynx"),
    ]
    return np.array(
        [[row, at, half, TISSUES[name].blood_fraction] for row, at, half, name in rows],
        dtype=np.float32,
    )
