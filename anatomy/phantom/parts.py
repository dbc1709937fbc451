"""The parts of the air of one side, and the walls behind each."""

from dataclasses import dataclass, replace

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
from anatomy.phantom.wall_noise import LIMITS_MM
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


@dataclass(frozen=True, slots=True)
class _Builder:
    """Make parts of one side."""

    side: Side

    def body(
        self,
        name: str,
        number: int,
        field: Field,
        label: Label,
        wall: Wall,
        steepness: float = 1.7,
        noise_mm: float = 0.0,
        sinus: str = "",
    ) -> Part:
        """Make a part with a cavity of its own number."""
        cavity = 10 * int(self.side) + number
        return Part(
            name, self.side, field, label, cavity, wall, steepness, noise_mm, sinus
        )

    def duct(
        self, name: str, field: Field, label: Label, wall: Wall, sinus: str = ""
    ) -> Part:
        """Make a part that joins two others."""
        return Part(name, self.side, field, label, DUCT, wall, 1.2, 0.0, sinus)


def healthy_parts(parameters: PhantomParameters, side: Side) -> list[Part]:
    """List the parts of one side without disease."""
    t = parameters.mucosa_mm
    septa = Wall(t, parameters.cell_bone_mm, Label.ETHMOID_SEPTUM)
    parts = _main_parts(parameters, side, septa)
    return parts + _variant_parts(parameters, side, septa)


def _main_parts(parameters: PhantomParameters, side: Side, septa: Wall) -> list[Part]:
    """List the parts that every side has."""
    body, duct = _Builder(side).body, _Builder(side).duct
    cells, t = ethmoid(parameters, side), parameters.mucosa_mm
    face = Wall(t, 0.3, Label.SPHENOID_WALL)
    uncinate = Wall(0.5, 0.25, Label.UNCINATE)
    nasal, fore, rear = Label.NASAL_AIR, "anterior_ethmoid", "posterior_ethmoid"
    anterior, posterior = Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR
    cavity = nasal_air(parameters, side)
    antrum = sinuses.lining(maxillary.maxillary(parameters, side))
    nerve = CANAL_WALL_MM + t - SHAPES["maxillary nerve"]
    antrum = _kept_off(antrum, t + FLOOR_BONE_MM - orbit_walls(), nerve)
    hollow = sinuses.lining(sphenoid_body(parameters, side))
    hollow = _kept_off(hollow, *canal_walls(parameters, side))
    front, back = Mark(Row.SINUS, cells.anterior), Mark(Row.SINUS, cells.posterior)
    canal = wall_over(parameters, side, "dehiscent-optic")
    back = _kept_off(back, canal - SHAPES["optic nerve"])
    large, small = Wall(t, 0.7), Wall(0.5, 0.25)
    infundibulum, ostium = SHAPES["infundibulum"], SHAPES["maxillary ostium"]
    # The bulla's face has no hole into the gutter before it.
    apart = t + septa.bone_mm + uncinate.mucosa_mm
    front = _kept_off(front, apart - infundibulum, apart - SHAPES["hiatus"])
    air, complex_ = Label.MAXILLARY_AIR, "ostiomeatal"
    return [
        body("nose", 1, cavity, nasal, Wall(1.0, 0.5), 2.4, 1.9),
        body("maxillary sinus", 2, antrum, air, large, 1.9, UNEVEN_MM, "maxillary"),
        body(
            "sphenoid sinus",
            4,
            hollow,
            Label.SPHENOID_AIR,
            face,
            1.9,
            UNEVEN_MM,
            "sphenoid",
        ),
        body("anterior ethmoid", 5, front, anterior, septa, 1.7, 0.2, fore),
        body("posterior ethmoid", 6, back, posterior, septa, 1.7, 0.2, rear),
        duct("infundibulum", infundibulum, nasal, uncinate, complex_),
        duct("maxillary ostium", ostium, nasal, small, complex_),
        duct("hiatus", SHAPES["hiatus"], nasal, uncinate, complex_),
        duct(
            "frontal recess",
            frontal_recess(parameters, side),
            anterior,
            Wall(t, 0.3),
            fore,
        ),
        duct("sphenoid ostium", SHAPES["sphenoid ostium"], nasal, face),
        duct("bulla outlet", SHAPES["bulla outlet"], anterior, septa, fore),
        duct("posterior outlet", SHAPES["posterior outlet"], posterior, septa, rear),
    ]


def _kept_off(lined: Mark, *walls: Field) -> Mark:
    """Bound a part by the walls of what it must not enter, whatever its unevenness."""
    return Mark(lined.row, smooth_max(0.8, lined.inner, *walls))


def _variant_parts(
    parameters: PhantomParameters, side: Side, septa: Wall
) -> list[Part]:
    """List the parts that only some sides have: cells with outlets, frontal sinuses."""
    body, duct = _Builder(side).body, _Builder(side).duct
    variant, fore, rear = (
        Label.VARIANT_CELL_AIR,
        "anterior_ethmoid",
        "posterior_ethmoid",
    )
    anterior, posterior = Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR
    parts = []

    def cell(name: str, number: int, field: Field, sinus: str) -> Part:
        marked = Mark(Row.SINUS, field)
        return body(name, number, marked, variant, septa, 1.8, 0.0, sinus)

    for name, number, label, sinus in (
        ("agger nasi", 7, anterior, fore),
        ("haller", 8, anterior, fore),
        ("concha bullosa", 9, variant, ""),
    ):
        if parameters.has(name.replace(" ", "-"), side):
            parts.append(cell(name, number, SHAPES[name], sinus))
            outlet = SHAPES[f"{name} outlet"]
            parts.append(duct(f"{name} outlet", outlet, label, septa, sinus))
    lobes = frontal(parameters, side)
    # These two share numbers with cells that lie too far away to have a common wall.
    if parameters.has("supraorbital-cell", side):
        way = sinuses.supraorbital_outlet(parameters)
        field = sinuses.supraorbital(parameters)
        parts.append(cell("supraorbital cell", 7, field, fore))
        parts.append(duct("supraorbital outlet", way, anterior, septa, fore))
    if parameters.has("frontal-septal-cell", side) and lobes is not None:
        way = SHAPES["septal cell outlet"]
        parts.append(cell("frontal septal cell", 8, SHAPES["septal cell"], fore))
        parts.append(duct("septal cell outlet", way, anterior, septa, fore))
    if parameters.has("accessory-ostium", side):
        second, wall = sinuses.accessory_ostium(parameters, side), Wall(0.5, 0.0)
        nasal = Label.NASAL_AIR
        parts.append(duct("accessory ostium", second, nasal, wall, "ostiomeatal"))
    if parameters.has("retrobulbar-recess", side):
        way = SHAPES["retrobulbar outlet"]
        parts.append(duct("retrobulbar outlet", way, anterior, septa, fore))
    if parameters.has("onodi", side):
        # It shares its cavity with the posterior cells that it grew from.
        parts.append(cell("onodi", 6, onodi(parameters, side), rear))
        way = SHAPES["onodi outlet"]
        parts.append(duct("onodi outlet", way, posterior, septa, rear))
    area = parameters.antrostomy_of(side)
    if area > 0.0:
        window = maxillary.antrostomy(area)
        parts.append(duct("antrostomy", window, Label.NASAL_AIR, Wall(0.5, 0.25)))
    if lobes is not None:
        parts.append(
            body(
                "frontal sinus",
                3,
                sinuses.lining(lobes),
                Label.FRONTAL_AIR,
                Wall(parameters.mucosa_mm, 1.5),
                1.8,
                UNEVEN_MM,
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
