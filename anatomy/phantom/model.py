"""One head: its parts, in the order in which they are united, as kernel tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.kernels.tables import Tables
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.parts import Part, side_parts
from anatomy.phantom.plates import Plate, plates
from anatomy.phantom.program import Encoder, Row
from anatomy.phantom.shapes import Field, Mark, smooth_min
from anatomy.phantom.spread import spread_waves, steepness
from anatomy.phantom.surroundings import Solid, common_marks, solids
from anatomy.phantom.wall_noise import noise_tables
from anatomy.tissue import TISSUES, Side

BAND_MM = 3.0
"""Where the model is evaluated: this far outside the air; deeper, only that it is."""


@dataclass(frozen=True, slots=True)
class Model:
    """The parts, the surroundings and the kernel tables of one head."""

    parameters: PhantomParameters
    parts: tuple[Part, ...]
    surroundings: tuple[Solid, ...]
    plates: tuple[Plate, ...]
    tables: Tables
    stack_depth: int
    mark_rows: int


def build_model(parameters: PhantomParameters) -> Model:
    """Build the head that `parameters` describe."""
    sides = {s: side_parts(parameters, s) for s in (Side.RIGHT, Side.LEFT)}
    # Ducts come last: then the opposite face of a wall is known before they join in.
    parts = tuple(
        sorted((p for ps, _ in sides.values() for p in ps), key=lambda p: p.cavity == 0)
    )
    painted = solids(parameters, {side: held for side, (_, held) in sides.items()})
    encoder = Encoder()
    for part in parts:
        part.field.encode(encoder)
        encoder.finish_field()
    marks: list[Field] = [Mark(row, field) for row, field in common_marks(parameters)]
    smooth_min(0.0, *marks).encode(encoder)
    encoder.finish_field()
    for solid in painted:
        if not isinstance(solid.field, Row):
            solid.field.encode(encoder)
            encoder.finish_field()
    thin = plates(parameters)
    for plate in thin:
        plate.zone.encode(encoder)
        encoder.finish_field()
    program = encoder.program()
    common = program.spans[len(parts)].copy()
    spans = iter(program.spans[len(parts) + 1 :])
    ground = [
        (0, 0) if isinstance(solid.field, Row) else next(spans) for solid in painted
    ]
    octaves, limits, permutation, gradients, grain = noise_tables(
        parameters.seed, parameters.unevenness
    )
    spread = spread_waves(parameters)
    bend = (1 + 0.1 * abs(parameters.septal_deviation_mm)) * (1 + steepness(spread))
    tables = Tables(
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
        common=common,
        spread=spread,
        septum=np.array(
            [parameters.septal_deviation_mm, -22, 1 / 14, 16, 1 / 12], dtype=np.float32
        ),
        octaves=octaves,
        limits=limits,
        perm=permutation,
        grad=gradients,
        grain=grain,
        tint=_tint_table(),
        solids=np.array(
            [
                [
                    s.field if isinstance(s.field, Row) else -1,
                    s.half_thickness_mm,
                    s.hu,
                    s.label,
                    s.level_mm,
                    s.steepness * bend,
                    s.grain_hu,
                ]
                for s in painted
            ],
            dtype=np.float32,
        ),
        ground=np.array(ground, dtype=np.int32),
        plates=program.spans[-len(thin) :].copy(),
    )
    return Model(
        parameters,
        parts,
        tuple(painted),
        thin,
        tables,
        program.depth,
        int(Row.FIRST_GROUND),
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
        (Row.POLYP, 0.4, 0.9, "polyp"),
        (Row.SINUS, 1.3, 1.4, "sinus lining"),
        (Row.REAR, 0.0, 3.0, "nasopharynx"),
        (Row.FLUID, 0.4, 0.4, "mucus"),
    ]
    return np.array(
        [[row, at, half, TISSUES[name].blood_fraction] for row, at, half, name in rows],
        dtype=np.float32,
    )
