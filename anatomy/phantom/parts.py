"""The parts of the air of one side, and the walls behind each."""

from dataclasses import dataclass, replace
from typing import Literal

import msgspec
import numpy as np

from anatomy.phantom import maxillary, sinuses
from anatomy.phantom.disease import Content, Disease, contents_of, drawn_findings
from anatomy.phantom.ethmoid import (
    CANAL_WALL_MM,
    ethmoid,
)
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.nose import nasal_air
from anatomy.phantom.orbit import FLOOR_BONE_MM, orbit_walls
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import Field, Mark, smooth_max
from anatomy.phantom.sinuses import frontal, frontal_recess
from anatomy.phantom.sphenoid import (
    canal_walls,
    onodi,
    sphenoid_body,
    wall_over,
)
from anatomy.phantom.uncinate import duct_wall, infundibulum
from anatomy.phantom.wall_noise import LIMITS_MM
from anatomy.table_file import read_table
from anatomy.tissue import Label, Side

UNEVEN_MM = LIMITS_MM[0] * sinuses.SINUS_UNEVENNESS
"""How far unevenness moves the wall of a large sinus."""

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


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``parts.toml``."""

    parts: tuple[tuple[str, int, str, str, float, float | Literal["sinus"], str], ...]


_TABLE = read_table(__file__, "parts.toml", _Table)


def healthy_parts(parameters: PhantomParameters, side: Side) -> list[Part]:
    """List the parts of one side without disease."""
    t = parameters.mucosa_mm
    walls = {
        "nose": Wall(1.0, 0.5),
        "large": Wall(t, 0.7),
        "small": Wall(0.5, 0.25),
        "face": Wall(t, 0.3, Label.SPHENOID_WALL),
        "septa": Wall(t, parameters.cell_bone_mm, Label.ETHMOID_SEPTUM),
        "recess": Wall(t, 0.3),
        "membrane": Wall(0.5, 0.0),
        "frontal": Wall(t, 1.5),
    }
    # The bulla's face has no hole into the gutter before it.
    apart = t + walls["septa"].bone_mm + walls["small"].mucosa_mm
    fields: dict[str, Field | None] = {
        **SHAPES,
        **_main_fields(parameters, side, apart),
        **_variant_fields(parameters, side),
    }
    found = []
    for name, number, label, wall, steepness, noise, sinus in _TABLE.parts:
        field = fields[name]
        if field is not None:
            cavity = 10 * int(side) + number if number else DUCT
            noise_mm = UNEVEN_MM if noise == "sinus" else noise
            found.append(
                Part(name, side, field, Label[label], cavity, walls[wall], steepness,
                     noise_mm, sinus)
            )  # fmt: skip
    return found


def _main_fields(
    parameters: PhantomParameters, side: Side, apart_mm: float
) -> dict[str, Field]:
    """Build what every side has. apart_mm: from the gutter to the anterior cells."""
    cells, t = ethmoid(parameters, side), parameters.mucosa_mm
    antrum = sinuses.lining(maxillary.maxillary(parameters, side))
    nerve = CANAL_WALL_MM + t - SHAPES["maxillary nerve"]
    hollow = sinuses.lining(sphenoid_body(parameters, side))
    front, back = Mark(Row.SINUS, cells.anterior), Mark(Row.SINUS, cells.posterior)
    gutter = infundibulum(parameters, side)
    duct = t - duct_wall()
    canal = wall_over(parameters, side, "dehiscent-optic")
    return {
        "nose": nasal_air(parameters, side),
        "maxillary sinus": _kept_off(
            antrum, t + FLOOR_BONE_MM - orbit_walls(), nerve, duct
        ),
        "sphenoid sinus": _kept_off(hollow, *canal_walls(parameters, side)),
        "anterior ethmoid": _kept_off(front, apart_mm - gutter),
        "infundibulum": gutter,
        "posterior ethmoid": _kept_off(back, canal - SHAPES["optic nerve"]),
        "frontal recess": frontal_recess(parameters, side),
    }


def _kept_off(lined: Mark, *walls: Field) -> Mark:
    """Bound a part by the walls of what it must not enter, whatever its unevenness."""
    return Mark(lined.row, smooth_max(0.8, lined.inner, *walls))


def _variant_fields(
    parameters: PhantomParameters, side: Side
) -> dict[str, Field | None]:
    """Build what only some sides have: cells with outlets, frontal sinuses."""
    lobes = frontal(parameters, side)
    area = parameters.antrostomy_of(side)
    found: dict[str, Field | None] = {
        "accessory ostium": sinuses.accessory_ostium(parameters, side),
        "antrostomy": maxillary.antrostomy(area) if area > 0.0 else None,
        "frontal sinus": None if lobes is None else sinuses.lining(lobes),
        "supraorbital outlet": sinuses.supraorbital_outlet(parameters),
    }
    if not parameters.has("accessory-ostium", side):
        found["accessory ostium"] = None
    if not parameters.has("retrobulbar-recess", side):
        found["retrobulbar outlet"] = None
    for name, cell, outlet in (
        ("agger nasi", SHAPES["agger nasi"], "agger nasi outlet"),
        ("haller", SHAPES["haller"], "haller outlet"),
        ("concha bullosa", SHAPES["concha bullosa"], "concha bullosa outlet"),
        ("supraorbital cell", sinuses.supraorbital(parameters), "supraorbital outlet"),
        ("frontal septal cell", SHAPES["septal cell"], "septal cell outlet"),
        ("onodi", onodi(parameters, side), "onodi outlet"),
    ):
        is_there = parameters.has(name.replace(" ", "-"), side)
        if name == "frontal septal cell":
            is_there = is_there and lobes is not None
        found[name] = Mark(Row.SINUS, cell) if is_there else None
        if not is_there:
            found[outlet] = None
    return found


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
        asked = parameters.findings_in(part.sinus, side)
        is_duct = part.cavity == DUCT
        if score == 1 and not asked and not is_duct:
            asked = drawn_findings(part.sinus, side, rng)
        if score != 2 and (is_duct or not asked):
            parts.append(part)
            continue
        disease = Disease(part.sinus, asked, parameters.posture, score == 2)
        change = contents_of(disease, part.field, is_duct, rng)
        contents += change.contents
        if change.air is not None:
            wall = replace(
                part.wall, mucosa_mm=part.wall.mucosa_mm + change.thickening_mm
            )
            parts.append(replace(part, field=change.air, wall=wall))
    return parts, contents
