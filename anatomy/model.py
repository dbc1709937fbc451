"""One head: its parts, in the order in which they are united, as kernel tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy import sinuses
from anatomy.bricks import kernels
from anatomy.honeycomb import Mark
from anatomy.noise import LIMITS_MM, noise_tables
from anatomy.nose import Row, nasal_air
from anatomy.parameters import PhantomParameters
from anatomy.program import Encoder
from anatomy.shapes import Field, smooth_min
from anatomy.surroundings import Solid, common_marks, solids
from anatomy.tissue import TISSUES, Label, Side

BAND_MM = 3.0
"""Where the model is evaluated: this far outside the air; deeper, only that it is."""


@dataclass(frozen=True, slots=True)
class Part:
    """Name one part of the air.

    steepness: bound of the gradient's norm, for leaving out bricks.
    noise_mm: bound of the part's unevenness.
    cavity: parts of one cavity have no wall between them; 0 joins cavities.
    mucosa_mm, bone_mm: layers behind the part's surface.
    """

    name: str
    side: Side
    field: Field
    label: Label
    cavity: int
    mucosa_mm: float
    bone_mm: float
    bone_label: Label
    steepness: float = 1.6
    noise_mm: float = 0.0


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
    bodies: list[Part] = []
    tubes: list[Part] = []
    for side in (Side.RIGHT, Side.LEFT):
        for part in _side_parts(parameters, side):
            (tubes if part.cavity == 0 else bodies).append(part)
    # Tubes come last: then the opposite face of a wall is known before they join in.
    parts = (*bodies, *tubes)
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


def _side_parts(parameters: PhantomParameters, side: Side) -> list[Part]:
    rng = np.random.default_rng([parameters.seed, int(side)])
    cells = sinuses.ethmoid(parameters, rng)
    lining, t = sinuses.lining, parameters.mucosa_mm
    base = 10 * int(side)
    fixed = LIMITS_MM[0] * sinuses.SINUS_UNEVENNESS
    bone = Label.THICK_BONE

    def part(
        name: str,
        field: Field | None,
        label: Label,
        cavity: int,
        *layers: float,
        bone_label: Label = bone,
        steepness: float = 1.7,
        noise_mm: float = 0.0,
    ) -> list[Part]:
        if field is None:
            return []
        number = base + cavity if cavity else 0
        mucosa, shell = layers
        return [
            Part(
                name,
                side,
                field,
                label,
                number,
                mucosa,
                shell,
                bone_label,
                steepness,
                noise_mm,
            )
        ]

    frontal = sinuses.frontal(parameters)
    has_frontal = frontal is not None
    septum_bone = parameters.cell_bone_mm
    return [
        *part(
            "nasal",
            nasal_air(parameters),
            Label.NASAL_AIR,
            1,
            1.0,
            0.5,
            bone_label=Label.CRIBRIFORM,
            steepness=2.2,
            noise_mm=LIMITS_MM[1] + 0.7,
        ),
        *part(
            "maxillary",
            lining(sinuses.maxillary(parameters)),
            Label.MAXILLARY_AIR,
            2,
            t,
            0.7,
            noise_mm=fixed,
            steepness=1.8,
        ),
        *part(
            "frontal",
            lining(frontal) if has_frontal else None,
            Label.FRONTAL_AIR,
            3,
            t,
            1.5,
            noise_mm=fixed,
        ),
        *part(
            "sphenoid",
            lining(sinuses.sphenoid(parameters)),
            Label.SPHENOID_AIR,
            4,
            t,
            0.8,
            noise_mm=fixed,
            bone_label=Label.SPHENOID_WALL,
        ),
        *part(
            "anterior ethmoid",
            Mark(Row.SINUS, cells.anterior),
            Label.ANTERIOR_ETHMOID_AIR,
            5,
            t,
            septum_bone,
            noise_mm=0.2,
            bone_label=Label.ETHMOID_SEPTUM,
        ),
        *part(
            "posterior ethmoid",
            Mark(Row.SINUS, cells.posterior),
            Label.POSTERIOR_ETHMOID_AIR,
            6,
            t,
            septum_bone,
            noise_mm=0.2,
            bone_label=Label.ETHMOID_SEPTUM,
        ),
        *part(
            "agger nasi",
            Mark(Row.SINUS, sinuses.agger_nasi()),
            Label.VARIANT_CELL_AIR,
            7,
            t,
            septum_bone,
            bone_label=Label.ETHMOID_SEPTUM,
        ),
        *part(
            "infundibulum",
            sinuses.infundibulum(),
            Label.ANTERIOR_ETHMOID_AIR,
            0,
            0.5,
            0.25,
            bone_label=Label.UNCINATE,
        ),
        *part(
            "maxillary ostium",
            sinuses.maxillary_ostium(),
            Label.MAXILLARY_AIR,
            0,
            0.5,
            0.25,
        ),
        *part(
            "hiatus",
            sinuses.hiatus(),
            Label.NASAL_AIR,
            0,
            0.5,
            0.25,
            bone_label=Label.UNCINATE,
        ),
        *part(
            "frontal recess",
            sinuses.frontal_recess() if has_frontal else None,
            Label.ANTERIOR_ETHMOID_AIR,
            0,
            t,
            0.3,
        ),
        *part(
            "agger outlet",
            sinuses.agger_outlet() if has_frontal else None,
            Label.ANTERIOR_ETHMOID_AIR,
            0,
            t,
            septum_bone,
        ),
        *part(
            "sphenoid ostium",
            sinuses.sphenoid_ostium(),
            Label.SPHENOID_AIR,
            0,
            t,
            0.5,
            bone_label=Label.SPHENOID_WALL,
        ),
        *part(
            "bulla outlet",
            sinuses.bulla_outlet(),
            Label.ANTERIOR_ETHMOID_AIR,
            0,
            t,
            septum_bone,
            bone_label=Label.ETHMOID_SEPTUM,
        ),
        *part(
            "posterior outlet",
            sinuses.posterior_outlet(),
            Label.POSTERIOR_ETHMOID_AIR,
            0,
            t,
            septum_bone,
            bone_label=Label.ETHMOID_SEPTUM,
        ),
    ]


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
