"""The parts of the air of one side, and the walls behind each."""

from dataclasses import dataclass

import numpy as np

from anatomy import sinuses
from anatomy.honeycomb import Mark
from anatomy.noise import LIMITS_MM
from anatomy.nose import Row, nasal_air
from anatomy.parameters import PhantomParameters
from anatomy.shapes import Field
from anatomy.tissue import Label, Side

DUCT = 0
"""The cavity of parts that join two others: they have no far side of a wall."""


@dataclass(frozen=True, slots=True)
class Wall:
    """Describe the layers behind a surface, in mm, and what their bone is called."""

    mucosa_mm: float
    bone_mm: float
    bone_label: Label = Label.THICK_BONE


@dataclass(frozen=True, slots=True)
class Part:
    """Name one part of the air.

    cavity: parts of one cavity have no wall between them; tens count the side.
    steepness: bound of the gradient's norm, and noise_mm of the unevenness: what the
    value can change on the way through a brick.
    """

    name: str
    side: Side
    field: Field
    label: Label
    cavity: int
    wall: Wall
    steepness: float
    noise_mm: float = 0.0


def side_parts(parameters: PhantomParameters, side: Side) -> list[Part]:
    """List the parts of one side; they differ by the drawn ethmoid cells."""
    rng = np.random.default_rng([parameters.seed, int(side)])
    cells = sinuses.ethmoid(parameters, rng)
    t, thin = parameters.mucosa_mm, parameters.cell_bone_mm
    uneven = LIMITS_MM[0] * sinuses.SINUS_UNEVENNESS
    septa = Wall(t, thin, Label.ETHMOID_SEPTUM)
    face = Wall(t, 0.3, Label.SPHENOID_WALL)
    anterior, posterior = Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR

    def body(
        name: str,
        number: int,
        field: Field,
        label: Label,
        wall: Wall,
        steepness: float = 1.7,
        noise_mm: float = 0.0,
    ) -> Part:
        cavity = 10 * int(side) + number
        return Part(name, side, field, label, cavity, wall, steepness, noise_mm)

    def duct(name: str, field: Field, label: Label, wall: Wall) -> Part:
        return Part(name, side, field, label, DUCT, wall, 1.2)

    maxillary = sinuses.lining(sinuses.maxillary(parameters))
    sphenoid = sinuses.lining(sinuses.sphenoid(parameters))
    nose = Wall(1.0, 0.5, Label.CRIBRIFORM)
    uncinate = Wall(0.5, 0.25, Label.UNCINATE)
    parts = [
        body("nose", 1, nasal_air(parameters), Label.NASAL_AIR, nose, 2.2, 1.9),
        body(
            "maxillary sinus",
            2,
            maxillary,
            Label.MAXILLARY_AIR,
            Wall(t, 0.7),
            1.8,
            uneven,
        ),
        body("sphenoid sinus", 4, sphenoid, Label.SPHENOID_AIR, face, 1.7, uneven),
        body(
            "anterior ethmoid",
            5,
            Mark(Row.SINUS, cells.anterior),
            anterior,
            septa,
            noise_mm=0.2,
        ),
        body(
            "posterior ethmoid",
            6,
            Mark(Row.SINUS, cells.posterior),
            posterior,
            septa,
            noise_mm=0.2,
        ),
        body(
            "agger nasi",
            7,
            Mark(Row.SINUS, sinuses.agger_nasi()),
            Label.VARIANT_CELL_AIR,
            septa,
        ),
        duct("infundibulum", sinuses.infundibulum(), anterior, uncinate),
        duct(
            "maxillary ostium",
            sinuses.maxillary_ostium(),
            Label.MAXILLARY_AIR,
            Wall(0.5, 0.25),
        ),
        duct("hiatus", sinuses.hiatus(), Label.NASAL_AIR, uncinate),
        duct("frontal recess", sinuses.frontal_recess(), anterior, Wall(t, 0.3)),
        duct("agger outlet", sinuses.agger_outlet(), anterior, septa),
        duct("sphenoid ostium", sinuses.sphenoid_ostium(), Label.SPHENOID_AIR, face),
        duct("bulla outlet", sinuses.bulla_outlet(), anterior, septa),
        duct("posterior outlet", sinuses.posterior_outlet(), posterior, septa),
    ]
    frontal = sinuses.frontal(parameters)
    if frontal is not None:
        wall = Wall(t, 1.5)
        lined = sinuses.lining(frontal)
        parts.append(
            body("frontal sinus", 3, lined, Label.FRONTAL_AIR, wall, 1.7, uneven)
        )
    return parts
