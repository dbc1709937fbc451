"""What lies behind mucosa and bone shells: orbit, brain, thick bone, soft tissue.

Painted in order, each solid over what came before, with coverage for its edge; in the
distance |x| from the septum's plane, unless the sides differ.
"""

from dataclasses import dataclass
from functools import partial

from anatomy.phantom import cheek, jaws, plates
from anatomy.phantom.disease import SHELL_MM, Content
from anatomy.phantom.ethmoid import (
    ethmoid_block,
    ethmoid_roof,
    keros_depth,
    lamina_papyracea,
)
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.head import head_outside
from anatomy.phantom.orbit import lateral_wall, orbit
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import below_base, skull_base
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Affine,
    Field,
    Mark,
    Recall,
    Table,
    U,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.sphenoid import sphenoid
from anatomy.phantom.sphenoid_bone import corpus, dorsum, pterygoid, temporal_lobe
from anatomy.phantom.turbinates import inferior_lift, middle_bow, middle_lean
from anatomy.phantom.vessels import ethmoidal_arteries, maxillary_canals
from anatomy.phantom.warp import extruded, one_side
from anatomy.tissue import TISSUES, Label, Side

_GRAIN_HU = {"cancellous bone": 130.0, "bone": 45.0}
"""Standard deviation of the trabeculae's CT numbers; tables of bone vary in thickness,
too."""

LABYRINTH_MM = 0.7
"""Round ethmoid cells and sphenoid sinus, where their walls are thick."""


@dataclass(frozen=True, slots=True)
class Solid:
    """Paint a tissue where a field is negative, or a sheet about its zero.

    row: an existing row of marks to use in place of `field`.
    half_thickness_mm: 0 for the solid below `level_mm`; else a sheet at that level.
    steepness: bound of the field's gradient near the level.
    """

    field: Field | Row
    tissue: str
    label: Label
    half_thickness_mm: float = 0.0
    level_mm: float = 0.0
    steepness: float = 1.6

    @property
    def hu(self) -> float:
        """Return the CT number."""
        return TISSUES[self.tissue].hu

    @property
    def grain_hu(self) -> float:
        """Return the deviation of the CT number from place to place."""
        return 0.0 if self.label == Label.TEETH else _GRAIN_HU.get(self.tissue, 0.0)


def skin() -> Field:
    """Recall the distance from the face, which the common marks leave."""
    return Recall(Row.FACE, head_outside())


def solids(
    parameters: PhantomParameters, contents: dict[Side, list[Content]]
) -> list[Solid]:
    """List the solids in the order in which they are painted.

    contents: what disease put into each side's sinuses.
    """
    filled = []
    for side, held in contents.items():
        sign = 1.0 if side == Side.RIGHT else -1.0
        for content in held:
            body = one_side(content.field, sign)
            roof = smooth_max(0.0, body, plates.fovea_zone(parameters))
            thick = plates.FOVEA_MM
            filled.append(Solid(roof, "skull base", Label.FOVEA, level_mm=thick))
            if content.has_shell:
                filled.append(Solid(body, "bone", Label.THICK_BONE, level_mm=SHELL_MM))
            filled.append(Solid(body, content.tissue, content.label, steepness=2.0))
    return [
        *_head(parameters),
        *_skull(parameters),
        *_orbits(parameters),
        *_vessels(parameters),
        *_midface(parameters),
        *filled,
        *_turbinates(parameters),
    ]


def _head(parameters: PhantomParameters) -> list[Solid]:
    face = skin()
    askew = partial(cheek.askew, parameters=parameters)
    base = below_base(parameters)
    # The vault's bone is thick over the orbits and thin over the ethmoid.
    thick = Table(U, (4, 12, 22), (0.35, 0.5, 2.0), 2.0)
    inner = smooth_max(4.0, base + thick, 13.0 - face * 1.6)
    vault = smooth_max(3.0, base - 0.2, 6.0 - face * 1.6)
    brain = smooth_max(4.0, base + thick + 1.6, 15.0 - face * 1.6)
    falx = smooth_max(0.5, u, smooth_max(1.0, base + 2.0, 14.0 - face * 1.6))
    crista = smooth_max(
        1.0,
        smooth_max(0.5, u - depth_table([8, 14, 26], [2.2, 1.3, 0.5]), z - 60.0),
        smooth_max(1.5, abs(y + 17.0) - 10.0, 44.0 - z),
    )
    crista = smooth_max(1.5, crista, z - depth_table([8, 16, 28], [60, 58, 48], 3.0))
    body, process = corpus(parameters), pterygoid()
    # Over ethmoid and olfactory cleft the roof is the walls' own plate.
    vault = smooth_max(0.8, vault, -plates.roofed(parameters))
    # The temporal lobe fills the middle fossa beside the sphenoid.
    lobe = temporal_lobe()
    vault = smooth_min(5.0, vault, lobe - 2.2)
    inner = smooth_min(5.0, inner, lobe)
    brain = smooth_min(5.0, brain, lobe + 1.6)
    # Between the tables of the vault's bone, where it is thick, lies marrow.
    diploe = smooth_max(1.0, vault + 2.2, 2.2 - inner)
    return [
        Solid(Affine(-50.0), "muscle", Label.MUSCLE, steepness=0.1),
        # The ledge that the uncinate process stands on is thicker than its walls.
        Solid(Row.UNCINATE, "uncinate", Label.UNCINATE),
        Solid(cheek.fat(face), "fat", Label.FAT, steepness=2.2),
        Solid(cheek.facial_sheet(face), "muscle", Label.MUSCLE, steepness=2.2),
        Solid(askew(SHAPES["parotid"]), "skin", Label.SKIN),
        Solid(askew(cheek.muscles()), "muscle", Label.MUSCLE),
        Solid(SHAPES["upper lip"], "muscle", Label.MUSCLE),
        Solid(face, "skin", Label.SKIN, 0.0, 1.5, 2.2),
        *_ethmoid(parameters),
        Solid(vault, "bone", Label.THICK_BONE, steepness=3.0),
        Solid(diploe, "cancellous bone", Label.THICK_BONE, steepness=3.0),
        Solid(inner, "csf", Label.CSF, steepness=3.0),
        Solid(brain, "brain", Label.BRAIN, steepness=3.0),
        Solid(falx, "dura", Label.DURA, 0.6, 0.0, 3.0),
        Solid(inner, "dura", Label.DURA, 0.25, -0.25, 3.0),
        Solid(body, "cancellous bone", Label.THICK_BONE, steepness=2.2),
        Solid(body, "bone", Label.THICK_BONE, 0.5, -0.5, 2.2),
        Solid(SHAPES["clivus"], "cancellous bone", Label.THICK_BONE),
        Solid(SHAPES["wings"], "cancellous bone", Label.THICK_BONE),
        Solid(SHAPES["wings"], "bone", Label.THICK_BONE, 0.4, -0.4),
        Solid(process, "cancellous bone", Label.THICK_BONE),
        Solid(process, "bone", Label.THICK_BONE, 0.4, -0.3),
        Solid(SHAPES["cavernous sinus"], "dura", Label.DURA),
        Solid(dorsum(), "cancellous bone", Label.THICK_BONE),
        Solid(SHAPES["pituitary"], "brain", Label.BRAIN),
        Solid(crista, "bone", Label.CRIBRIFORM, steepness=2.0),
        Solid(askew(SHAPES["zygomatic arch"]), "bone", Label.THICK_BONE),
    ]


def _ethmoid(parameters: PhantomParameters) -> list[Solid]:
    """List what lies between the shells of cells, and behind their roof."""
    found = []
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        # Between two cells the plate has its number; lining fills what is left.
        block = one_side(ethmoid_block(parameters, side), sign)
        found.append(
            Solid(
                block,
                "mucosa",
                Label.ETHMOID_SEPTUM,
                level_mm=LABYRINTH_MM,
                steepness=2.0,
            )
        )
        cave = one_side(sphenoid(parameters, side), sign)
        found.append(
            Solid(
                cave,
                "cancellous bone",
                Label.SPHENOID_WALL,
                level_mm=LABYRINTH_MM,
                steepness=2.0,
            )
        )
    behind = plates.behind_roof(parameters)
    return [*found, Solid(behind, "dura", Label.DURA, steepness=3.0)]


def _vessels(parameters: PhantomParameters) -> list[Solid]:
    fossa, canal, nerve = (
        SHAPES[name]
        for name in ("pterygopalatine fossa", "pterygoid canal", "maxillary nerve")
    )
    rotundum, infraorbital = maxillary_canals()
    found = [
        Solid(SHAPES["internal carotid"], "blood", Label.INTERNAL_CAROTID),
        Solid(SHAPES["superior fissure"], "fat", Label.ORBITAL_FISSURE),
        Solid(SHAPES["inferior fissure"], "fat", Label.ORBITAL_FISSURE),
        Solid(canal, "bone", Label.SPHENOID_WALL, level_mm=0.5),
        Solid(rotundum, "bone", Label.THICK_BONE, level_mm=0.5),
        Solid(infraorbital, "bone", Label.THICK_BONE, level_mm=0.4),
        Solid(fossa, "fat", Label.PTERYGOPALATINE_FOSSA),
        Solid(canal, "optic nerve", Label.VIDIAN_NERVE),
        Solid(nerve, "optic nerve", Label.MAXILLARY_NERVE),
        Solid(SHAPES["sphenopalatine artery"], "blood", Label.SPHENOPALATINE_ARTERY),
        Solid(SHAPES["nasolacrimal duct"], "bone", Label.THICK_BONE, 0.0, 0.5),
        Solid(SHAPES["nasolacrimal duct"], "mucosa", Label.NASOLACRIMAL_DUCT),
    ]
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        artery = one_side(ethmoidal_arteries(parameters, side), sign)
        hangs = parameters.has("hanging-artery", side)
        canal_bone = Label.ETHMOID_SEPTUM if hangs else Label.FOVEA
        found.append(Solid(artery, "bone", canal_bone, level_mm=0.3))
        found.append(Solid(artery, "blood", Label.ETHMOIDAL_ARTERY))
    return found


def _midface(parameters: PhantomParameters) -> list[Solid]:
    face = skin()
    palate, alveolus = jaws.palate(face), jaws.alveolus(face)
    teeth = jaws.upper_teeth(parameters)
    zygoma = cheek.askew(SHAPES["zygoma"], parameters)
    suture = cheek.askew(cheek.zygomatic_suture(), parameters)
    # Between the nose, the orbit and the frontal sinus there is little but bone.
    beak = smooth_max(2.0, abs(u - 8.5) - 4.5, smooth_max(2.0, abs(y + 9) - 9, 40 - z))
    beak = smooth_max(2.0, beak, z - 58.0, -below_base(parameters) - 1.2)
    lacrimal = smooth_max(
        2.0, abs(u - 9.5) - 3.5, smooth_max(2, abs(y + 12) - 8, z - 40)
    )
    lacrimal = smooth_max(2.0, lacrimal, 14.0 - z)
    roof = ethmoid_roof(parameters)
    # The septum ends under the cribriform plate.
    top = z - roof + keros_depth(parameters)
    crest = -1.5 - z
    slab = smooth_max(0.5, u - 2.2, crest, smooth_max(1.0, top + 0.3, -57.0 - y))
    plate = smooth_max(0.0, u, crest, smooth_max(1.0, top - 0.3, -56.0 - y))
    front = height_table([-4, 0, 12, 30, 40], [4, -3, -17, -3, 0], 2.0)
    plate = smooth_max(0.0, plate, y - front)
    cartilage = smooth_max(0.0, u, smooth_max(1.0, front - y, z - 30.0))
    pyramid_rear = height_table([-12, 8, 20, 30, 40], [2, 0, 1, 9, 12], 2.0)
    pyramid = smooth_max(2.0, smooth_max(2.0, pyramid_rear - y, u - 16.0), z - 32.0)
    alar = extruded(((2.2, 10.0), (7.0, 8.0), (10.0, 1.0)))
    alar = smooth_max(0.5, alar, 7.0 - y)
    return [
        Solid(palate, "cancellous bone", Label.THICK_BONE, steepness=2.2),
        Solid(palate, "bone", Label.THICK_BONE, 0.6, -0.6, 2.2),
        Solid(alveolus, "cancellous bone", Label.THICK_BONE, steepness=2.2),
        Solid(alveolus, "bone", Label.THICK_BONE, 0.5, -0.5, 2.2),
        Solid(teeth, "bone", Label.TEETH, 0.0, 0.0),
        Solid(teeth, "tooth", Label.TEETH, 0.0, -0.6),
        Solid(teeth, "cartilage", Label.TEETH, 0.0, -3.6),
        Solid(zygoma, "cancellous bone", Label.THICK_BONE),
        Solid(zygoma, "bone", Label.THICK_BONE, 0.6, -0.6),
        Solid(suture, "cartilage", Label.THICK_BONE),
        Solid(lacrimal, "mucosa", Label.MUCOSA),
        Solid(beak, "cancellous bone", Label.THICK_BONE, steepness=3.0),
        Solid(SHAPES["frontal process"], "bone", Label.THICK_BONE),
        Solid(pyramid, "skin", Label.SKIN, steepness=2.0),
        Solid(alar, "cartilage", Label.SEPTAL_CARTILAGE, 0.0, 0.5, 1.2),
        Solid(SHAPES["nasal bone"], "bone", Label.THICK_BONE),
        Solid(slab, "mucosa", Label.MUCOSA),
        Solid(cartilage, "cartilage", Label.SEPTAL_CARTILAGE, 0.9, 0.0, 2.2),
        Solid(plate, "bone", Label.SEPTAL_BONE, 0.45, 0.0, 2.2),
    ]


def _turbinates(parameters: PhantomParameters) -> list[Solid]:
    # The inferior concha's bone comes off the wall, arches, and curls under.
    scroll = extruded(
        ((13.6, 15.6), (11.6, 15.0), (9.6, 13.2), (8.6, 10.6), (9.0, 8.2), (10.2, 7.4)),
        du=depth_table([8, 17, 27, 37, 48], [0.0, 0.5, -0.4, 0.6, 0.0], 3.0),
        dz=-inferior_lift(),
    )
    scroll = smooth_max(0.0, scroll, smooth_max(0.0, abs(y + 27.5) - 20.5))
    roof = ethmoid_roof(parameters)
    found = [
        Solid(Row.TORUS, "torus", Label.MUCOSA),
        Solid(Row.INFERIOR, "inferior turbinate", Label.INFERIOR_TURBINATE),
        Solid(scroll, "turbinate bone", Label.TURBINATE_BONE, 0.0, 0.28, 1.2),
        Solid(Row.MIDDLE, "middle turbinate", Label.MIDDLE_TURBINATE),
        Solid(Row.SUPERIOR, "superior turbinate", Label.SUPERIOR_TURBINATE),
    ]
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        # It ends where it hangs from the skull base, beside the olfactory fossa.
        height = smooth_max(1.0, 22.0 - z, z - roof + keros_depth(parameters))
        bowed = u - middle_bow(parameters, side)
        plate = smooth_max(0.0, abs(bowed - middle_lean(parameters, side)), height)
        plate = smooth_max(0.0, plate, abs(y + 34.0) - 17.5)
        found.append(
            Solid(
                one_side(plate, sign),
                "turbinate bone",
                Label.TURBINATE_BONE,
                0.0,
                0.2,
                1.4,
            )
        )
    superior = smooth_max(0.0, abs(u - 5.3), smooth_max(0.5, 34.5 - z, abs(y + 46) - 6))
    superior = smooth_max(0.0, superior, z - 45.0)
    found.append(
        Solid(superior, "turbinate bone", Label.TURBINATE_BONE, 0.0, 0.15, 1.2)
    )
    found.append(Solid(Row.POLYP, "polyp", Label.POLYP))
    return found


def common_marks(parameters: PhantomParameters) -> list[tuple[Row, Field]]:
    """List the marks that need no part in reach, in the order in which they count."""
    return [
        (Row.SEPTUM, u - 3.2),
        (Row.REAR, y + 56.0),
        (Row.FACE, Mark(Row.FACE, head_outside())),
        # Dry are the vestibule and the outside of the whole face.
        (
            Row.SKIN,
            smooth_min(
                0.0,
                (3.0 + 0.12 * z - y) * 0.5,
                1.5 * Recall(Row.FACE, head_outside()) - 1.5,
            ),
        ),
        (Row.BASE, skull_base(parameters) - z),
    ]


def _skull(parameters: PhantomParameters) -> list[Solid]:
    """List the solids of jaw, rear skull base and spine.

    They close the head of a wide field of view; none reaches into the nose's own.
    """
    cerebellum, column = SHAPES["cerebellum"], SHAPES["spine"]
    hind = smooth_min(6.0, cerebellum, SHAPES["brain stem"])
    occiput = smooth_max(4.0, cerebellum - 6.0, z - 47.0)
    jaw = cheek.askew(jaws.mandible(), parameters)
    return [
        Solid(column, "cancellous bone", Label.THICK_BONE),
        Solid(column, "bone", Label.THICK_BONE, 0.5, -0.5),
        Solid(occiput, "bone", Label.THICK_BONE),
        Solid(SHAPES["petrous bone"], "bone", Label.THICK_BONE),
        Solid(hind - 1.6, "csf", Label.CSF),
        Solid(hind, "brain", Label.BRAIN),
        Solid(jaw, "cancellous bone", Label.THICK_BONE),
        Solid(jaw, "bone", Label.THICK_BONE, 0.7, -0.7),
        Solid(jaws.lower_teeth(), "tooth", Label.TEETH),
        Solid(SHAPES["rear zygomatic arch"], "bone", Label.THICK_BONE),
    ]


def _orbits(parameters: PhantomParameters) -> list[Solid]:
    found = [Solid(lateral_wall(), "bone", Label.THICK_BONE, steepness=2.4)]
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        inside = one_side(orbit(parameters, side, skin()), sign)
        # Beside the ethmoid the cells' own shell is the wall: no other bone there.
        beside = smooth_min(0.0, lamina_papyracea(parameters, side) - u + 3.0, -19 - y)
        shell = smooth_max(0.0, inside, beside)
        found.append(
            Solid(shell, "bone", Label.THICK_BONE, level_mm=1.3, steepness=2.4)
        )
        found.append(Solid(inside, "fat", Label.FAT, steepness=2.4))
    globe = SHAPES["globe"]
    found += [
        Solid(globe, "muscle", Label.GLOBE),
        Solid(globe, "vitreous", Label.GLOBE, level_mm=-0.9),
        Solid(SHAPES["lens"], "lens", Label.LENS),
        Solid(SHAPES["eye muscles"], "muscle", Label.EXTRAOCULAR_MUSCLE),
        Solid(SHAPES["optic nerve"], "csf", Label.OPTIC_NERVE),
        Solid(SHAPES["optic nerve"], "optic nerve", Label.OPTIC_NERVE, level_mm=-0.7),
    ]
    return found
