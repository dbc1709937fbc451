"""What lies behind mucosa and bone shells: orbit, brain, thick bone, soft tissue.

Painted in order, each solid over what came before, with coverage for its edge; in the
distance |x| from the septum's plane, unless the sides differ.
"""

from dataclasses import dataclass
from functools import partial

import msgspec

from anatomy.phantom import lower_face, plates
from anatomy.phantom.disease import SHELL_MM, Content
from anatomy.phantom.ethmoid import (
    ethmoid_block,
    ethmoid_roof,
    ethmoidal_arteries,
    keros_depth,
    lamina_papyracea,
    maxillary_canals,
)
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.head import head_outside
from anatomy.phantom.orbit import lateral_plane, lateral_wall, orbit
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import below_base, skull_base
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Affine,
    Chain,
    Ellipsoid,
    Field,
    Mark,
    Recall,
    Table,
    U,
    Warp,
    as_field,
    depth_table,
    extruded,
    height_table,
    one_side,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.sphenoid import sphenoid
from anatomy.phantom.turbinates import inferior_lift, middle_bow, middle_lean
from anatomy.table_file import read_table
from anatomy.tissue import TISSUES, Label, Side

_GRAIN_HU = {"cancellous bone": 130.0, "bone": 45.0}
"""Standard deviation of the trabeculae's CT numbers; tables of bone vary in thickness,
too."""


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


_Painted = tuple[tuple[str, str, str, float, float, float], ...]
"""Of each solid: shape, tissue, label, half thickness, level, steepness."""


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``solids.toml``."""

    before_disease: _Painted
    after_disease: _Painted


_TABLE = read_table(__file__, "solids.toml", _Table)

_SIDES = (Side.RIGHT, 1.0), (Side.LEFT, -1.0)

Shapes = dict[str, Field | Row | None]
"""Shapes by their names in the table; None is not there in this head."""


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
    for side, sign in _SIDES:
        for content in contents[side]:
            body = one_side(content.field, sign)
            roof = smooth_max(0.0, body, plates.fovea_zone(parameters))
            thick = plates.FOVEA_MM
            filled.append(Solid(roof, "skull base", Label.FOVEA, level_mm=thick))
            if content.has_shell:
                filled.append(Solid(body, "bone", Label.THICK_BONE, level_mm=SHELL_MM))
            filled.append(Solid(body, content.tissue, content.label, steepness=2.0))
    shapes: Shapes = {
        **SHAPES,
        **_head(parameters),
        **_skull(parameters),
        **_of_sides(parameters),
        **_midface(parameters),
        **_turbinates(),
    }
    return [
        *_painted(_TABLE.before_disease, shapes),
        *filled,
        *_painted(_TABLE.after_disease, shapes),
    ]


def _painted(rows: _Painted, shapes: Shapes) -> list[Solid]:
    found = []
    for name, tissue, label, half_mm, level_mm, steepness in rows:
        shape = shapes[name]
        if shape is not None:
            found.append(
                Solid(shape, tissue, Label[label], half_mm, level_mm, steepness)
            )
    return found


def _head(parameters: PhantomParameters) -> Shapes:
    face = skin()
    askew = partial(lower_face.askew, parameters=parameters)
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
    # Over ethmoid and olfactory cleft the roof is the walls' own plate.
    vault = smooth_max(0.8, vault, -plates.roofed(parameters))
    # The temporal lobe fills the middle fossa beside the sphenoid.
    lobe = temporal_lobe()
    vault = smooth_min(5.0, vault, lobe - 2.2)
    inner = smooth_min(5.0, inner, lobe)
    brain = smooth_min(5.0, brain, lobe + 1.6)
    # Between the tables of the vault's bone, where it is thick, lies marrow.
    diploe = smooth_max(1.0, vault + 2.2, 2.2 - inner)
    return {
        "everywhere": Affine(-50.0),
        "uncinate process": Row.UNCINATE,
        "fat": lower_face.fat(face),
        "facial sheet": lower_face.facial_sheet(face),
        "parotid": askew(SHAPES["parotid"]),
        "chewing muscles": askew(lower_face.muscles()),
        "skin": face,
        "behind roof": plates.behind_roof(parameters),
        "vault": vault,
        "diploe": diploe,
        "inside skull": inner,
        "brain": brain,
        "falx": falx,
        "sphenoid body": corpus(parameters),
        "pterygoid": pterygoid(),
        "dorsum sellae": dorsum(),
        "crista galli": crista,
        "zygomatic arch": askew(SHAPES["zygomatic arch"]),
    }


def _skull(parameters: PhantomParameters) -> Shapes:
    """List the shapes of jaw and rear skull base.

    They close the head of a wide field of view; none reaches into the nose's own.
    """
    cerebellum = SHAPES["cerebellum"]
    hind = smooth_min(6.0, cerebellum, SHAPES["brain stem"])
    return {
        "occiput": smooth_max(4.0, cerebellum - 6.0, z - 47.0),
        "hindbrain fluid": hind - 1.6,
        "hindbrain": hind,
        "lower jaw": lower_face.askew(lower_face.mandible(), parameters),
        "lower teeth": lower_face.lower_teeth(),
    }


def _of_sides(parameters: PhantomParameters) -> Shapes:
    """List the shapes that are not alike on both sides."""
    found: Shapes = {"lateral orbital wall": lateral_wall()}
    found["foramen rotundum"], found["infraorbital canal"] = maxillary_canals()
    roof = ethmoid_roof(parameters)
    for side, sign in _SIDES:
        inside = one_side(orbit(parameters, side, skin()), sign)
        # Beside the ethmoid the cells' own shell is the wall: no other bone there.
        beside = smooth_min(0.0, lamina_papyracea(parameters, side) - u + 3.0, -19 - y)
        artery = one_side(ethmoidal_arteries(parameters, side), sign)
        hangs = parameters.has("hanging-artery", side)
        # The concha ends at the skull base, beside the olfactory fossa.
        height = smooth_max(1.0, 22.0 - z, z - roof + keros_depth(parameters))
        bowed = u - middle_bow(parameters, side)
        concha = smooth_max(0.0, abs(bowed - middle_lean(parameters, side)), height)
        concha = smooth_max(0.0, concha, abs(y + 34.0) - 17.5)
        shapes: Shapes = {
            "labyrinth": one_side(ethmoid_block(parameters, side), sign),
            "sphenoid": one_side(sphenoid(parameters, side), sign),
            "orbital shell": smooth_max(0.0, inside, beside),
            "orbit": inside,
            "ethmoidal canal": None if hangs else artery,
            "hanging canal": artery if hangs else None,
            "ethmoidal artery": artery,
            "middle concha": one_side(concha, sign),
        }
        name = side.name.lower()
        found |= {f"{shape}, {name}": field for shape, field in shapes.items()}
    return found


def _midface(parameters: PhantomParameters) -> Shapes:
    face = skin()
    # Between the nose, the orbit and the frontal sinus there is little but bone.
    beak = smooth_max(2.0, abs(u - 8.5) - 4.5, smooth_max(2.0, abs(y + 9) - 9, 40 - z))
    beak = smooth_max(2.0, beak, z - 58.0, -below_base(parameters) - 1.2)
    lacrimal = smooth_max(
        2.0, abs(u - 9.9) - 3.9, smooth_max(2.0, abs(y + 18) - 15, 14.0 - z)
    )
    lacrimal = smooth_max(2.0, lacrimal, z - depth_table([20, 26], [42.0, 25.0]))
    # The frontal process and the lacrimal bone bear the sac between nose and orbit.
    bearing = smooth_max(1.5, abs(u - 11.2) - 2.2, abs(y + 9.0) - 5.5)
    bearing = smooth_max(1.5, bearing, abs(z - 27.0) - 15.0)
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
    return {
        "palate": lower_face.palate(face),
        "alveolus": lower_face.alveolus(face),
        "upper teeth": lower_face.upper_teeth(parameters),
        "zygoma": lower_face.askew(SHAPES["zygoma"], parameters),
        "zygomatic suture": lower_face.askew(lower_face.zygomatic_suture(), parameters),
        "lacrimal region": lacrimal,
        "lacrimal crest": bearing,
        "nasofrontal beak": beak,
        "nasal pyramid": pyramid,
        "alar cartilage": alar,
        "septal mucosa": slab,
        "septal cartilage": cartilage,
        "septal bone": plate,
    }


def _turbinates() -> Shapes:
    # The inferior concha's bone comes off the wall, arches, and curls under.
    scroll = extruded(
        ((13.6, 15.6), (11.6, 15.0), (9.6, 13.2), (8.6, 10.6), (9.0, 8.2), (10.2, 7.4)),
        du=depth_table([8, 17, 27, 37, 48], [0.0, 0.5, -0.4, 0.6, 0.0], 3.0),
        dz=-inferior_lift(),
    )
    scroll = smooth_max(0.0, scroll, smooth_max(0.0, abs(y + 27.5) - 20.5))
    superior = smooth_max(0.0, abs(u - 5.3), smooth_max(0.5, 34.5 - z, abs(y + 46) - 6))
    return {
        "torus": Row.TORUS,
        "inferior turbinate": Row.INFERIOR,
        "inferior concha": scroll,
        "middle turbinate": Row.MIDDLE,
        "superior turbinate": Row.SUPERIOR,
        "superior concha": smooth_max(0.0, superior, z - 45.0),
        "polyps": Row.POLYP,
    }


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


def corpus(parameters: PhantomParameters) -> Field:
    """Build the body from the sinus's face to the clivus, under planum and sella."""
    half: Field = depth_table([56, 61, 68, 78, 92], [13.2, 15.2, 14.0, 13.4, 15.0], 3.0)
    half = half + height_table([16, 24, 32, 40], [-5.0, -0.5, 0.0, 0.5], 4.0)
    floor = depth_table([55, 66, 78, 95], [21.0, 18.6, 15.0, 6.0], 4.0)
    body = smooth_max(5.0, u - half, floor - z)
    body = smooth_max(4.0, body, smooth_max(4.0, y + 56.0, -95.0 - y))
    return smooth_max(1.5, body, -below_base(parameters))


def dorsum() -> Field:
    """Build the sella's rear wall with the posterior clinoid processes."""
    top = Table(U, (0, 5, 7.5, 10), (45.2, 45.8, 46.6, 38.0), 1.5)
    thick = height_table([38, 47], [4.0, 1.2], 2.0)
    slab = smooth_max(1.0, abs(y + 81.2) - thick, z - top)
    return smooth_max(1.5, slab, smooth_max(1.0, 36.0 - z, u - 9.0))


def pterygoid() -> Field:
    """Build the pterygoid process: its root and its two plates.

    The medial plate goes on behind the nose's side wall, the lateral one flares.
    """
    low = smooth_max(1.0, -6.0 - z, z - 24.0)
    flat = as_field(0.0)
    bow = height_table([-6, 6, 16, 24], [-0.5, 0.5, 0.3, -0.3], 4.0)
    flare = height_table([-6, 4, 14, 24], [-3.0, 0.2, 0.9, 0.0], 4.0)
    medial = Warp(bow, flat, -z, Chain(((14.4, -55, 0), (14.9, -63, 0)), (0.6, 0.4)))
    lateral = Warp(flare, flat, -z, Chain(((16.5, -55, 0), (21.5, -65, 0)), (0.7, 0.4)))
    plates = smooth_max(2.0, smooth_min(0.6, medial, lateral), low)
    return smooth_min(1.0, SHAPES["pterygoid root"], plates)


def temporal_lobe() -> Field:
    """Build the lobe in the middle fossa, its pole behind the orbit."""
    pole = smooth_max(
        5.0, Ellipsoid((36, -81, 42), (17.5, 34, 19)), 6.0 - lateral_plane()
    )
    return smooth_min(6.0, pole, Ellipsoid((41, -86, 42), (20, 25, 21)))
