"""The tools of an endoscopic sinus operation: what each does, and how large it is.

Sizes. Casiano's dissection guide (chapter on instrumentation) lists 3.5 mm straight
and upbiting forceps, both grasping and through-cutting, a 360-degree backbiting
forceps, a ball probe, a 4 mm curved suction, 10 and 12 French Frazier suctions and a
4 mm straight powered cannula. Goode describes a powered 3.5 mm sheath with an opening
at the side near its tip. Lengths of jaws and windows, the knife, the elevator and the
curette are recalled from makers' catalogues.

Forces. Joice 2010 (Am J Rhinol Allergy 24): 6.1 N through ethmoid lamellae and lamina
papyracea, 17.8 N through the skull base, in cadavers; Joice 2012 (Allergy Rhinol 3):
1.5 times as much in patients. What a tool brings on bone is set between these: grasping
forceps and through-cutting punches take lamellae and spare the skull base, which a
backbiter or a curette can break. Seven microdebriders abraded spicules and none abraded
intact bone (Am J Otolaryngol 1999;20:294). A scope is pressed with 2.2 N on average and
8.0 N at most (Eur Arch Otorhinolaryngol 2008), a probe about as much. Thicknesses of
bone and flows of suction are estimates.
"""

from dataclasses import dataclass
from enum import Enum
from functools import cache

import numpy as np

from renderers.scene import Mesh
from renderers.scene.mesh import PlacedMesh
from scenarios.instrument_state import FIRST_TOOL, NO_TOOL
from scenarios.instruments.forceps import Backbiter, Forceps
from scenarios.instruments.hand_tools import (
    BallProbe,
    Curette,
    Elevator,
    InjectionNeedle,
    SickleKnife,
)
from scenarios.instruments.lofting import joined
from scenarios.instruments.parts import (
    Capsules,
    Doubles,
    InstrumentPart,
    Shape,
    moved,
)
from scenarios.instruments.suction import CurvedSuction, Debrider, Frazier
from surgery import solids
from surgery.edit import CuttingLimits
from system import UserError


class Action(Enum):
    """When a tool takes tissue."""

    BITE = "bite"
    """When its jaws close."""
    POWERED = "powered"
    """While its pedal is down and the suction is on."""
    SCRAPE = "scrape"
    """While it is dragged under force."""
    CUT = "cut"
    """While its edge moves."""
    FEEL = "feel"
    """Never: it tells hard from soft."""
    INJECT = "inject"
    """Never: it gives, while its pedal is down."""
    SUCK = "suck"
    """Never: it takes blood and loose pieces."""


USUAL_N, MOST_N = 2.2, 8.0
"""A scope or a probe is pressed with so much on average and at most, see above."""

NOTHING = CuttingLimits()

TORN_MM, SHAVED_MM, CLEAN_MM = 0.15, 0.08, 0.05
"""Roughness of what is torn, of what is shaved or scraped, and of a clean cut."""


@dataclass(frozen=True, slots=True)
class Instrument:
    """Describe one tool.

    taker: force that it brings on bone, N, and thickest bone that it takes, mm.
    suction_ml_s: flow through it. rough_mm: amplitude of the roughness that it leaves:
    forceps tear, punches and knives cut smoothly (estimates).
    Its frame: origin at the end of the tip, +z back up the shaft, bent parts, windows
    and jaws towards +y. `scenarios.tip_frame` gives it a place and a roll.
    """

    name: str
    action: Action
    shape: Shape
    taker: CuttingLimits = NOTHING
    suction_ml_s: float = 0.0
    rough_mm: float = 0.0

    @property
    def needs_suction(self) -> bool:
        """Return whether it takes tissue only while it sucks."""
        return self.action is Action.POWERED

    @property
    def has_jaws(self) -> bool:
        """Return whether a part of it turns about a hinge."""
        return any(part.open_deg for part in parts_of(self))

    def placed(self, world_from_instrument: Doubles, jaw: float) -> list[PlacedMesh]:
        """Return its parts' meshes with their 4x4 poses; jaw: 0 open, 1 closed."""
        return [
            (
                part.mesh,
                world_from_instrument @ part.pose(jaw)
                if part.open_deg
                else world_from_instrument,
            )
            for part in parts_of(self)
        ]

    def mesh(self, jaw: float = 1.0) -> Mesh:
        """Return it as one mesh in its own frame."""
        parts = parts_of(self)
        if len(parts) == 1:
            return parts[0].mesh
        return joined(
            *(
                Mesh(moved(mesh.vertices, pose), mesh.faces, mesh.material)
                for mesh, pose in self.placed(np.eye(4), jaw)
            )
        )

    def capsules(self, world_from_instrument: Doubles, jaw: float) -> Capsules:
        """Return what it is to contact and clearance, in the world."""
        return Capsules.joined(
            [
                part.capsules.placed(world_from_instrument @ part.pose(jaw))
                for part in parts_of(self)
            ]
        )

    def tip_ball(self, world_from_instrument: Doubles) -> tuple[Doubles, float]:
        """Return middle ``(3,)`` in the world and radius of the ball at its end, mm."""
        middle, radius = self.shape.tip()
        return moved(middle[None], world_from_instrument)[0], radius

    def end(self, world_from_instrument: Doubles, length_mm: float) -> Capsules:
        """Return one or two capsules of so much of its end in the world."""
        return self.shape.end(length_mm).placed(world_from_instrument)

    def working_volume(
        self,
        world_from_instrument: Doubles,
        jaw: float = 1.0,
        before: Doubles | None = None,
    ) -> solids.Rows:
        """Return what comes away, as rows of `surgery.solids` in the world.

        With jaws: what they enclose when they close from `jaw`; 1 is what the closed
        cups hold. Others: what their edge sweeps from the pose `before`, 4x4, which is
        the present one if None; a turn between the two should be small. No rows for
        what only feels or sucks.
        """
        bitten = self.shape.bite(jaw).copy()
        bitten[:, 1:4] = moved(bitten[:, 1:4], world_from_instrument)
        bitten[:, 4:7] = moved(bitten[:, 4:7], world_from_instrument)
        points, radius = self.shape.edge()
        new = moved(points, world_from_instrument)
        old = new if before is None else moved(points, before)
        swept = [
            solids.blade(old[k : k + 2], new[k : k + 2], radius)
            for k in range(len(points) - 1)
        ]
        return np.concatenate([bitten, *swept])


@cache
def parts_of(instrument: Instrument) -> tuple[InstrumentPart, ...]:
    """Return an instrument's parts, the shaft first, built once."""
    return instrument.shape.parts()


_CATALOGUE = (
    Instrument(FIRST_TOOL, Action.SUCK, Frazier(), suction_ml_s=20.0),
    Instrument("curved suction", Action.SUCK, CurvedSuction(), suction_ml_s=30.0),
    Instrument(
        "straight forceps",
        Action.BITE,
        Forceps(),
        CuttingLimits(20.0, 0.8),
        rough_mm=TORN_MM,
    ),
    Instrument(
        "upturned forceps",
        Action.BITE,
        Forceps(turn_deg=45.0),
        CuttingLimits(20.0, 0.8),
        rough_mm=TORN_MM,
    ),
    Instrument(
        "through-cutting punch",
        Action.BITE,
        Forceps(jaw_mm=9.0, cup_mm=6.0, open_deg=45.0, through=True),
        CuttingLimits(25.0, 1.0),
        rough_mm=CLEAN_MM,
    ),
    Instrument(
        "backbiter",
        Action.BITE,
        Backbiter(),
        CuttingLimits(40.0, 2.0),
        rough_mm=CLEAN_MM,
    ),
    Instrument(
        "microdebrider",
        Action.POWERED,
        Debrider(),
        CuttingLimits(4.0, 0.2),
        suction_ml_s=15.0,
        rough_mm=SHAVED_MM,
    ),
    Instrument(
        "curette",
        Action.SCRAPE,
        Curette(),
        CuttingLimits(30.0, 1.5),
        rough_mm=SHAVED_MM,
    ),
    Instrument(
        "sickle knife",
        Action.CUT,
        SickleKnife(),
        CuttingLimits(12.0, 0.3),
        rough_mm=CLEAN_MM,
    ),
    Instrument("ball probe", Action.FEEL, BallProbe(), CuttingLimits(3.0)),
    Instrument(
        "injection needle", Action.INJECT, InjectionNeedle(), CuttingLimits(1.0)
    ),
    Instrument(
        "elevator",
        Action.SCRAPE,
        Elevator(),
        CuttingLimits(12.0, 0.3),
        rough_mm=SHAVED_MM,
    ),
)

INSTRUMENTS = {each.name: each for each in _CATALOGUE}


def instrument_named(name: str) -> Instrument:
    """Look a tool up; UserError names those that there are."""
    found = INSTRUMENTS.get(name)
    if found is None:
        raise UserError(
            f"There is no instrument {name!r}; there are: {', '.join(INSTRUMENTS)}."
        )
    return found


def placed_tool(
    name: str, world_from_instrument: Doubles, jaw: float
) -> list[PlacedMesh]:
    """Return what is to be drawn of a tool; nothing for `NO_TOOL`.

    world_from_instrument: 4x4. jaw: 0 open, 1 closed.
    """
    if name == NO_TOOL:
        return []
    return instrument_named(name).placed(world_from_instrument, jaw)
