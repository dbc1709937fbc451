"""What lies behind mucosa and bone shells: orbit, brain, thick bone, soft tissue.

Painted in order, each solid over what came before, with coverage for its edge; both
sides at once in the distance |x| from the midline. Simple solids: enough for a CT
that reads as a head and for a danger that has a place.
"""

from dataclasses import dataclass

from anatomy.honeycomb import Mark
from anatomy.nose import Row, ethmoid_roof, outside
from anatomy.parameters import PhantomParameters
from anatomy.shapes import (
    Affine,
    Chain,
    Ellipsoid,
    Field,
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
from anatomy.sinuses import lamina_papyracea
from anatomy.tissue import TISSUES, Label


@dataclass(frozen=True, slots=True)
class Solid:
    """Paint a tissue where a field is negative, or a sheet about its zero.

    row: an existing row of marks to use in place of `field`.
    half_thickness_mm: 0 for the solid below `level_mm`; else a sheet at that level.
    """

    field: Field | Row
    tissue: str
    label: Label
    half_thickness_mm: float = 0.0
    level_mm: float = 0.0

    @property
    def hu(self) -> float:
        """Get the CT number."""
        return TISSUES[self.tissue].hu


def solids(parameters: PhantomParameters) -> list[Solid]:
    """List the solids in the order in which they are painted."""
    roof = ethmoid_roof(parameters)
    lamina = lamina_papyracea()
    skin = outside()

    # The skull base is lowest in the midline and rises over the orbits.
    base = roof + Table(U, (9, 20, 32, 44), (0, 4.0, 7.0, 6.0), 4.0) * depth_table(
        [-5, 10, 35, 55], [0.3, 1.0, 0.8, 0.0], 4.0
    )
    vault = smooth_max(3.0, base - 0.2 - z, 6.0 - skin * 1.6)
    brain = smooth_max(5.0, base + 2.0 - z, 15.0 - skin * 1.6)
    arch = Table(U, (0, 8, 14, 20), (-3.5, -4.2, -6.5, -9.0), 3.0)
    maxilla = smooth_max(3.0, smooth_max(3.0, u - 27.0, z - 0.5), -49.0 - y)
    maxilla = smooth_max(3.0, maxilla, y + Table(U, (0, 10, 20, 28), (2, 5, 12, 24)))
    palate = smooth_max(1.5, maxilla, arch - z)
    alveolus = smooth_max(3.0, maxilla, smooth_min(3.0, 17.0 - u, -11.0 - y))
    roots = [
        Chain(((a, b, -9), (0.94 * a + 0.5, b - 1.5, -22)), (1.6, 2.6))
        for a, b in ((4, -5), (9.5, -7), (15, -12), (19, -19), (22, -27), (23, -37))
    ]
    teeth = smooth_min(0.0, *roots)
    zygoma = Chain(((31, -15, 12), (38, -16, 21), (41, -20, 30)), (4.5, 5.5, 4.0))
    process = Chain(
        ((10.5, -5, 8), (10.5, -5.5, 20), (9.5, -4.5, 32), (6.5, -2.5, 46)),
        (1.5, 1.7, 2.0, 3.0),
    )
    nasal_bone = Chain(((1.0, 8.0, 25), (1.0, 2.2, 37), (1.0, -2.5, 49)), (0.9, 1.3, 3))
    body = smooth_max(
        6.0,
        smooth_max(6.0, abs(z - 33.0) - 16.0, u - 21.0),
        smooth_max(4.0, y + 56.0, -95.0 - y),
    )
    clivus = Chain(((0, -80, 30), (0, -83, 5), (0, -86, -15)), (12.0, 8.0, 7.0))
    pterygoid = Chain(((14.5, -55, 22), (15, -57, 5), (15.5, -58, -6)), (1.6, 1.3, 1.1))

    cone = Chain(((31, -12, 38), (16.5, -51, 42)), (17.0, 2.5))
    orbit = smooth_max(2.0, cone, smooth_max(2.0, lamina + 0.3 - u, 3.0 - skin * 1.6))
    globe = Ellipsoid((31, -10, 38), (12, 12, 12))
    lens = Ellipsoid((31, 0.5, 38), (4.5, 2.0, 4.5))
    nerve = Chain(
        ((29, -22, 38), (17, -47, 42), (14, -60, 44), (5, -74, 48)), (2.2,) * 4
    )
    muscles = smooth_min(
        0.0,
        Chain(((20.5, -12, 38), (19, -28, 39), (16.5, -47, 41.5)), (1.2, 2.2, 1.0)),
        Chain(((30, -12, 25.5), (26, -28, 28), (17.5, -47, 40)), (1.2, 2.2, 1.0)),
        Chain(((30, -12, 50.5), (26, -28, 49), (17.5, -47, 43.5)), (1.2, 2.2, 1.0)),
        Chain(((43, -14, 38), (35, -30, 39), (18, -47, 41.5)), (1.2, 2.2, 1.0)),
    )
    carotid = Chain(
        ((19.5, -84, 20), (19, -79, 29), (17.5, -76, 36), (15, -68, 44)), (2.5,) * 4
    )
    duct = Chain(((12, -6, 34), (12.5, -12, 7)), (1.6, 1.4))

    crest = -1.5 - z
    slab = smooth_max(0.5, u - 2.2, crest, smooth_max(2.0, z - roof, -57.0 - y))
    plate = smooth_max(0.0, u, crest, smooth_max(1.0, z - roof, -56.0 - y))
    front = height_table([-4, 0, 12, 30, 40], [4, -3, -17, -3, 0], 2.0)
    plate = smooth_max(0.0, plate, y - front)
    cartilage = smooth_max(0.0, u, smooth_max(1.0, front - y, z - 30.0))
    pyramid_rear = height_table([-12, 8, 20, 30, 40], [2, 0, 1, 9, 12], 2.0)
    pyramid = smooth_max(2.0, smooth_max(2.0, pyramid_rear - y, u - 16.0), z - 32.0)
    lean = height_table([20, 26, 30, 38, 45], [6.8, 6.1, 5.6, 4.9, 4.3], 3.0)
    lamella = smooth_max(0.0, abs(u - lean), smooth_max(1.0, 22.0 - z, z - roof + 5.0))
    lamella = smooth_max(0.0, lamella, abs(y + 34.0) - 17.5)
    return [
        Solid(Affine(-50.0), "muscle", Label.MUSCLE),
        Solid(Mark(Row.FACE, skin), "fat", Label.FAT, 0.0, 6.0),
        Solid(Row.FACE, "skin", Label.SKIN, 0.0, 1.5),
        Solid(vault, "cancellous bone", Label.THICK_BONE),
        Solid(brain, "brain", Label.BRAIN),
        Solid(body, "cancellous bone", Label.THICK_BONE),
        Solid(clivus, "cancellous bone", Label.THICK_BONE),
        Solid(pterygoid, "bone", Label.THICK_BONE),
        Solid(palate, "bone", Label.THICK_BONE),
        Solid(alveolus, "cancellous bone", Label.THICK_BONE),
        Solid(teeth, "tooth", Label.TEETH),
        Solid(zygoma, "cancellous bone", Label.THICK_BONE),
        Solid(process, "bone", Label.THICK_BONE),
        Solid(orbit, "fat", Label.FAT),
        Solid(globe, "vitreous", Label.GLOBE),
        Solid(lens, "lens", Label.LENS),
        Solid(muscles, "muscle", Label.EXTRAOCULAR_MUSCLE),
        Solid(nerve, "optic nerve", Label.OPTIC_NERVE),
        Solid(carotid, "blood", Label.INTERNAL_CAROTID),
        Solid(duct, "muscle", Label.NASOLACRIMAL_DUCT),
        Solid(pyramid, "skin", Label.SKIN),
        Solid(nasal_bone, "bone", Label.THICK_BONE),
        Solid(slab, "mucosa", Label.MUCOSA),
        Solid(cartilage, "cartilage", Label.SEPTAL_CARTILAGE, 0.9),
        Solid(plate, "bone", Label.SEPTAL_BONE, 0.45),
        Solid(Row.TORUS, "torus", Label.MUCOSA),
        Solid(Row.INFERIOR, "inferior turbinate", Label.INFERIOR_TURBINATE),
        Solid(Row.INFERIOR, "thin bone", Label.TURBINATE_BONE, 0.25, -1.7),
        Solid(Row.MIDDLE, "middle turbinate", Label.MIDDLE_TURBINATE),
        Solid(Row.SUPERIOR, "superior turbinate", Label.SUPERIOR_TURBINATE),
        Solid(lamella, "thin bone", Label.TURBINATE_BONE, 0.2),
    ]


def common_marks() -> list[tuple[Row, Field]]:
    """List the marks that need no part in reach: septum, dry skin, rear of the nose."""
    return [
        (Row.SEPTUM, u - 3.2),
        (Row.SKIN, (3.0 + 0.12 * z - y) * 0.5),
        (Row.REAR, y + 56.0),
    ]
