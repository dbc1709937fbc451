"""What lies behind mucosa and bone shells: orbit, brain, thick bone, soft tissue.

Painted in order, each solid over what came before, with coverage for its edge; both
sides at once in the distance |x| from the midline. Simple solids: enough for a CT
that reads as a head and for a danger that has a place.
"""

from dataclasses import dataclass

from anatomy.nose import Row, ethmoid_roof, outside
from anatomy.parameters import PhantomParameters
from anatomy.shapes import (
    Chain,
    Ellipsoid,
    Field,
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
    half_thickness_mm: 0 for a solid; else `field` is the distance to a mid-surface.
    """

    field: Field | Row
    tissue: str
    label: Label
    half_thickness_mm: float = 0.0

    @property
    def hu(self) -> float:
        """Get the CT number."""
        return TISSUES[self.tissue].hu


def solids(parameters: PhantomParameters) -> list[Solid]:
    """List the solids in the order in which they are painted."""
    roof = ethmoid_roof(parameters)
    lamina = lamina_papyracea()
    skin = outside()

    # Behind the forehead and above the skull base; the roof of the orbit is domed.
    base = smooth_max(3.0, roof, height_table([0, 1], [0, 0]) + 0.0)
    above = smooth_max(4.0, roof + 1.8 - z + u * 0.05, y + 3.0)
    brain = smooth_max(3.0, above, 58.0 - 0.35 * y - z - 30.0)
    skull = smooth_max(3.0, roof - 0.2 - z, -5.0 - skin * 1.5)
    forehead = smooth_max(2.0, 50.0 - z, smooth_max(2.0, -skin - 30.0, skin * 0 - 1.0))

    maxilla = smooth_max(2.0, smooth_max(2.0, u - 27.0, z - 0.5), -50.0 - y)
    maxilla = smooth_max(2.0, maxilla, y + 1.0 + u * u * 0.022)
    palate = smooth_max(1.0, maxilla, -6.5 - z)
    alveolus = smooth_max(2.0, maxilla, smooth_min(2.0, 17.0 + 0.0 * u - u, -12.0 - y))
    zygoma = Chain(((31, -14, 14), (38, -14, 21), (41, -18, 30)), (5.0, 6.0, 4.5))
    process = Chain(
        ((10.5, -5, 8), (10.5, -5.5, 20), (9.5, -4.5, 32), (6.5, -2.5, 46)),
        (1.6, 1.8, 2.2, 3.6),
    )
    nasal_bone = Chain(((1, 9.5, 24), (1, 3.0, 36), (1, -2.5, 49)), (1.2, 1.6, 3.5))
    body = smooth_max(
        4.0,
        smooth_max(4.0, abs(z - 33.0) - 16.0, u - 21.0),
        smooth_max(4.0, y + 55.5, -95.0 - y),
    )
    clivus = Chain(((0, -80, 30), (0, -83, 5), (0, -86, -15)), (12.0, 8.0, 7.0))
    pterygoid = Chain(((13, -55.5, 22), (13.5, -57, 5), (14, -58, -6)), (1.8, 1.6, 1.4))

    cone = Chain(((31, -12, 38), (16.5, -51, 42)), (17.0, 2.5))
    orbit = smooth_max(2.0, cone, smooth_max(2.0, lamina + 0.3 - u, -8.0 - skin))
    globe = Ellipsoid((31, -10, 38), (12, 12, 12))
    nerve = Chain(
        ((29, -22, 38), (17, -47, 42), (14, -60, 44), (5, -74, 48)), (2.2,) * 4
    )
    medial_rectus = Chain(
        ((20.5, -12, 38), (19, -28, 39), (16.5, -47, 41.5)), (1.6, 2.4, 1.0)
    )
    inferior_rectus = Chain(
        ((30, -12, 25.5), (26, -28, 28), (17.5, -47, 40)), (1.4, 2.2, 1.0)
    )
    superior_rectus = Chain(
        ((30, -12, 50.5), (26, -28, 49), (17.5, -47, 43.5)), (1.4, 2.2, 1.0)
    )
    lateral_rectus = Chain(
        ((43, -14, 38), (35, -30, 39), (18, -47, 41.5)), (1.4, 2.2, 1.0)
    )
    muscles = smooth_min(
        0.0, medial_rectus, inferior_rectus, superior_rectus, lateral_rectus
    )
    carotid = Chain(
        ((19.5, -84, 20), (19, -79, 29), (17.5, -76, 36), (15, -68, 44)), (2.5,) * 4
    )
    duct = Chain(((12, -6, 34), (12.5, -12, 7)), (1.6, 1.4))

    septum = smooth_max(0.5, u - 1.0, smooth_max(2.0, z - roof, -57.0 - y))
    cartilage = smooth_max(1.0, septum, 10.0 - 0.9 * z - y - 14.0)
    cartilage = smooth_max(1.0, septum, height_table([0, 12, 30], [-3, -16, -2]) - y)
    pyramid = smooth_max(
        2.0,
        smooth_max(
            2.0, height_table([-12, 8, 20, 30, 40], [2, 0, 1, 9, 12]) - y, u - 16.0
        ),
        z - 32.0,
    )
    inferior_bone = depth_table([8, 14, 44, 48], [3.0, 1.5, 1.5, 3.0])
    return [
        Solid(u * 0.0 - 50.0, "muscle", Label.MUSCLE),
        Solid(-7.0 - skin, "fat", Label.FAT),
        Solid(-2.2 - skin, "skin", Label.SKIN),
        Solid(skull, "cancellous bone", Label.THICK_BONE),
        Solid(brain, "brain", Label.BRAIN),
        Solid(body, "cancellous bone", Label.THICK_BONE),
        Solid(clivus, "cancellous bone", Label.THICK_BONE),
        Solid(pterygoid, "bone", Label.THICK_BONE),
        Solid(palate, "bone", Label.THICK_BONE),
        Solid(alveolus, "cancellous bone", Label.THICK_BONE),
        Solid(zygoma, "cancellous bone", Label.THICK_BONE),
        Solid(process, "bone", Label.THICK_BONE),
        Solid(orbit, "fat", Label.FAT),
        Solid(globe, "vitreous", Label.GLOBE),
        Solid(muscles, "muscle", Label.EXTRAOCULAR_MUSCLE),
        Solid(nerve, "optic nerve", Label.OPTIC_NERVE),
        Solid(carotid, "blood", Label.INTERNAL_CAROTID),
        Solid(duct, "muscle", Label.NASOLACRIMAL_DUCT),
        Solid(pyramid, "skin", Label.SKIN),
        Solid(nasal_bone, "bone", Label.THICK_BONE),
        Solid(septum, "bone", Label.SEPTAL_BONE),
        Solid(cartilage, "cartilage", Label.SEPTAL_CARTILAGE),
        Solid(Row.TORUS, "torus", Label.MUCOSA),
        Solid(Row.INFERIOR, "inferior turbinate", Label.INFERIOR_TURBINATE),
        Solid(Row.MIDDLE, "middle turbinate", Label.MIDDLE_TURBINATE),
        Solid(Row.SUPERIOR, "superior turbinate", Label.SUPERIOR_TURBINATE),
    ]


def common_marks() -> list[tuple[Row, Field]]:
    """List the marks that need no part in reach: septum, dry skin, rear of the nose."""
    return [
        (Row.SEPTUM, u - 3.2),
        (Row.SKIN, (3.0 + 0.12 * z - y) * 0.5),
        (Row.REAR, y + 56.0),
    ]
