"""The parts of the air of one side, and the walls behind each."""

from dataclasses import dataclass, replace

import numpy as np

from anatomy.phantom import sinuses
from anatomy.phantom.disease import Content, contents_of
from anatomy.phantom.ethmoid import bulla_outlet, ethmoid, posterior_outlet
from anatomy.phantom.frontal import frontal, frontal_recess
from anatomy.phantom.nose import nasal_air
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import Field, Mark
from anatomy.phantom.sphenoid import onodi, onodi_outlet, sphenoid, sphenoid_ostium
from anatomy.phantom.wall_noise import LIMITS_MM
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
    sinus: which Lund-Mackay score it belongs to, if any.
    """

    name: str
    side: Side
    field: Field
    label: Label
    cavity: int
    wall: Wall
    steepness: float
    noise_mm: float = 0.0
    sinus: str = ""


def healthy_parts(parameters: PhantomParameters, side: Side) -> list[Part]:
    """List the parts of one side without disease."""
    cells = ethmoid(parameters, side)
    t, thin = parameters.mucosa_mm, parameters.cell_bone_mm
    uneven = LIMITS_MM[0] * sinuses.SINUS_UNEVENNESS
    septa = Wall(t, thin, Label.ETHMOID_SEPTUM)
    face = Wall(t, 0.3, Label.SPHENOID_WALL)
    anterior, posterior = Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR
    variant = Label.VARIANT_CELL_AIR

    def body(
        name: str,
        number: int,
        field: Field,
        label: Label,
        wall: Wall,
        steepness: float = 1.7,
        noise_mm: float = 0.0,
        sinus: str = "",
    ) -> Part:
        cavity = 10 * int(side) + number
        return Part(name, side, field, label, cavity, wall, steepness, noise_mm, sinus)

    def cell(name: str, number: int, field: Field, sinus: str) -> Part:
        marked = Mark(Row.SINUS, field)
        return body(name, number, marked, variant, septa, 1.8, 0.0, sinus)

    def duct(
        name: str, field: Field, label: Label, wall: Wall, sinus: str = ""
    ) -> Part:
        return Part(name, side, field, label, DUCT, wall, 1.2, 0.0, sinus)

    ostiomeatal = "ostiomeatal"
    fore, rear = "anterior_ethmoid", "posterior_ethmoid"
    uncinate = Wall(0.5, 0.25, Label.UNCINATE)
    parts = [
        body(
            "nose",
            1,
            nasal_air(parameters, side),
            Label.NASAL_AIR,
            Wall(1.0, 0.5),
            2.4,
            1.9,
        ),
        body(
            "maxillary sinus",
            2,
            sinuses.lining(sinuses.maxillary(parameters, side)),
            Label.MAXILLARY_AIR,
            Wall(t, 0.7),
            1.9,
            uneven,
            "maxillary",
        ),
        body(
            "sphenoid sinus",
            4,
            sinuses.lining(sphenoid(parameters, side)),
            Label.SPHENOID_AIR,
            face,
            1.9,
            uneven,
            "sphenoid",
        ),
        body(
            "anterior ethmoid",
            5,
            Mark(Row.SINUS, cells.anterior),
            anterior,
            septa,
            noise_mm=0.2,
            sinus=fore,
        ),
        body(
            "posterior ethmoid",
            6,
            Mark(Row.SINUS, cells.posterior),
            posterior,
            septa,
            noise_mm=0.2,
            sinus=rear,
        ),
        duct(
            "infundibulum",
            sinuses.infundibulum(),
            Label.NASAL_AIR,
            uncinate,
            ostiomeatal,
        ),
        duct(
            "maxillary ostium",
            sinuses.maxillary_ostium(),
            Label.NASAL_AIR,
            Wall(0.5, 0.25),
            ostiomeatal,
        ),
        duct("hiatus", sinuses.hiatus(), Label.NASAL_AIR, uncinate, ostiomeatal),
        duct("frontal recess", frontal_recess(), anterior, Wall(t, 0.3), fore),
        duct("sphenoid ostium", sphenoid_ostium(), Label.NASAL_AIR, face),
        duct("bulla outlet", bulla_outlet(), anterior, septa, fore),
        duct("posterior outlet", posterior_outlet(), posterior, septa, rear),
    ]
    for name, number, build, outlet, label, sinus in (
        ("agger-nasi", 7, sinuses.agger_nasi, sinuses.agger_outlet, anterior, fore),
        ("haller", 8, sinuses.haller, sinuses.haller_outlet, anterior, fore),
        ("concha-bullosa", 9, sinuses.concha, sinuses.concha_outlet, variant, ""),
    ):
        if parameters.has(name, side):
            words = name.replace("-", " ")
            parts.append(cell(words, number, build(), sinus))
            parts.append(duct(f"{words} outlet", outlet(), label, septa, sinus))
    if parameters.has("onodi", side):
        # It shares its cavity with the posterior cells that it grew from.
        parts.append(cell("onodi", 6, onodi(parameters, side), rear))
        parts.append(duct("onodi outlet", onodi_outlet(), posterior, septa, rear))
    lobes = frontal(parameters, side)
    if lobes is not None:
        parts.append(
            body(
                "frontal sinus",
                3,
                sinuses.lining(lobes),
                Label.FRONTAL_AIR,
                Wall(t, 1.5),
                1.8,
                uneven,
                "frontal",
            )
        )
    return parts


def side_parts(
    parameters: PhantomParameters, side: Side
) -> tuple[list[Part], list[Content]]:
    """List the parts of one side, and what disease has put in place of air."""
    opacity = parameters.opacity_of(side)
    rng = np.random.default_rng([parameters.seed, int(side), 0x6C6D])
    parts: list[Part] = []
    contents: list[Content] = []
    for part in healthy_parts(parameters, side):
        score = getattr(opacity, part.sinus) if part.sinus else 0
        if score == 0:
            parts.append(part)
            continue
        change = contents_of(part.sinus, part.field, part.cavity == DUCT, score, rng)
        contents += change.contents
        if change.air is not None:
            wall = replace(
                part.wall, mucosa_mm=part.wall.mucosa_mm + change.thickening_mm
            )
            parts.append(replace(part, field=change.air, wall=wall))
    return parts, contents
