"""The nasal cavity of one side: septum, turbinates, lateral wall, vestibule, pharynx.

Coordinates and sizes follow radiological averages of adult noses; where none was
found they were chosen so that the views of a nasal endoscopy come out.
"""

from dataclasses import dataclass
from enum import IntEnum

from anatomy.honeycomb import Mark, Unevenness
from anatomy.parameters import PhantomParameters
from anatomy.shapes import (
    Chain,
    Field,
    FlatTube,
    Point,
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


class Row(IntEnum):
    """Name the rows of marks; the kernels know the same numbers."""

    INFERIOR = 0
    MIDDLE = 1
    SUPERIOR = 2
    UNCINATE = 3
    TORUS = 4
    PHARYNX = 5
    OUTSIDE = 6
    SINUS = 7
    SEPTUM = 8
    SKIN = 9
    REAR = 10
    FACE = 11
    FIRST_GROUND = 12


def ethmoid_roof(parameters: PhantomParameters) -> Field:
    """Give the height of the fovea ethmoidalis over the depth."""
    return depth_table([15, 55], [52.5, 47.0])


@dataclass(frozen=True, slots=True)
class Turbinates:
    """Hold the solids that stand in the cavity."""

    inferior: Field
    middle: Field
    superior: Field
    uncinate: Field


def turbinates(parameters: PhantomParameters) -> Turbinates:
    """Build the three turbinates and the uncinate process."""
    g = parameters.congestion
    depths = [4.5, 5.2, 6.5, 9, 14, 30, 42, 49, 51]
    inferior = FlatTube(
        depth_table(depths, [9.6, 9.6, 9.5, 9.4, 9.2, 9.3, 9.5, 9.6, 9.6]),
        depth_table(depths, [10.9, 10.9, 10.8, 10.6, 10.2, 10, 10.2, 10.8, 11]),
        depth_table(
            depths,
            [
                0.1,
                1.2,
                1.9 + g,
                2.5 + 1.6 * g,
                2.7 + 1.8 * g,
                2.7 + 1.8 * g,
                2.6 + 1.6 * g,
                2.2 + g,
                0.1,
            ],
            0.3,
        ),
        depth_table(depths, [0.1, 1.9, 3.2, 4.3, 4.8, 4.8, 4.6, 3.4, 0.2], 0.3),
    )
    inferior_tube = smooth_max(1.0, inferior, abs(y + 27.75) - 23.4)
    root = smooth_max(0.8, 9.2 - u, abs(z - 0.30 * u - 11.7) - 1.1)
    root = smooth_max(0.8, root, u - 15.0)
    root = smooth_max(1.5, root, abs(y + 27.5) - 21.5)
    inferior_solid = smooth_min(1.5, inferior_tube, root)

    # The middle turbinate has a bulbous head, a curled lower edge, and a lamella that
    # leans and is bowed along y.
    bow = depth_table(
        [10, 16, 24, 33, 42, 51], [-0.4, 0.0, 0.6, 0.9, 0.6, 0.0], 3.0
    ) * height_table([12, 22, 30, 38, 46], [0.1, 0.7, 1.0, 0.7, 0.1], 3.0)
    side = u - bow + (1.0 if parameters.uncinectomy else 0.0)
    depths = [14.5, 16.5, 20, 28, 42, 51, 53]
    head = FlatTube(
        depth_table(depths, [5.9, 6.0, 6.4, 6.9, 7.1, 6.9, 6.9]) + (u - side),
        depth_table(depths, [26.5, 25.5, 23.6, 22.2, 21.4, 21.6, 21.8]),
        depth_table(depths, [0.6, 1.6, 2.0 + g, 1.9 + g, 1.6 + 0.8 * g, 1.2, 0.3], 0.4),
        depth_table(depths, [1.4, 3.2, 4.0, 3.4, 3.0, 2.2, 0.5], 0.4),
    )
    head_tube = smooth_max(1.2, head, abs(y + 33.75) - 19.4)
    edge = depth_table([14, 20, 28, 42, 52], [27, 23.6, 22.2, 21.4, 21.6])
    lean = height_table([20, 26, 30, 38, 45], [6.8, 6.1, 5.6, 4.9, 4.3], 3.0)
    reach = 18 - 0.05 * smooth_max(2.0, z - 36, 0.0)
    lamella = smooth_max(
        0.6, abs(side - lean) - 0.65, smooth_max(1.0, edge - z, abs(y + 34) - reach)
    )
    front = height_table([20, 26, 38, 46], [-15, -14.5, -16.5, -20], 2.0)
    lamella = smooth_max(1.5, lamella, y - front)
    # The axilla: the head hangs from the lateral wall by a neck.
    neck = Chain(((6.2, -16.5, 26), (5.9, -15, 31), (5.0, -14, 37)), (1.6, 1.5, 1.6))
    middle = smooth_min(2.6, smooth_min(3.0, head_tube, neck), lamella)

    depths = [38, 41, 46, 51, 53]
    flange = FlatTube(
        depth_table(depths, [5.2, 5.2, 5.2, 5.3, 5.4]),
        depth_table(depths, [38, 36.6, 34.8, 33.4, 33.0]),
        depth_table(depths, [0.1, 0.8, 1.0, 0.8, 0.1], 0.3),
        depth_table(depths, [0.2, 1.6, 2.0, 1.6, 0.2], 0.3),
    )
    flange_tube = smooth_max(0.8, flange, abs(y + 45.5) - 7.6)
    plate = smooth_max(
        0.5,
        abs(u - 5.3) - 0.5,
        smooth_max(1.0, depth_table([38, 52], [37, 33]) - z, abs(y + 46) - 6.5),
    )
    superior = smooth_min(1.0, flange_tube, plate)

    # The uncinate process is a curved sheet with a free rear edge in front of the
    # hiatus, on a smooth ledge of the lateral wall.
    free_edge = height_table(
        [16, 20, 24, 28, 34, 40], [-32, -29.5, -26, -23.2, -20.5, -18.5], 2.0
    )
    sheet = depth_table([6, 10, 14, 18, 22, 26], [13.9, 11.9, 10.5, 9.5, 9.2, 9.2], 2.0)
    uncinate = smooth_max(
        1.2,
        abs(u - sheet - 0.9) - 1.25,
        smooth_max(1.5, free_edge - y, abs(z - 28) - 13),
    )
    uncinate = smooth_max(2.0, uncinate, y + 11)
    ledge = smooth_max(
        2.0,
        smooth_max(2.0, abs(u - 12.7) - 2.5, abs(y + 20) - 9.5),
        smooth_max(2.0, 16.0 - z, z - depth_table([12, 22, 30], [40, 25, 20], 2.0)),
    )
    if parameters.uncinectomy:
        uncinate = smooth_max(1.5, ledge, y + 19.5)
    else:
        uncinate = smooth_min(1.5, uncinate, ledge)
    return Turbinates(
        Mark(Row.INFERIOR, inferior_solid),
        Mark(Row.MIDDLE, middle),
        Mark(Row.SUPERIOR, superior),
        Mark(Row.UNCINATE, uncinate),
    )


def septum_face() -> Field:
    """Give the lateral position of the septum's mucosa."""
    face = height_table([0, 4, 12, 20, 30, 45], [2.0, 1.3, 1.4, 1.5, 1.7, 1.0], 1.5)
    thin_rear = depth_table([22, 46], [0.0, -0.5], 3.0)
    swell_body = depth_table([-2, 10, 22], [0.0, 0.45, 0.0], 4.0) * height_table(
        [18, 26, 34], [0.0, 1.0, 0.0], 3.0
    )
    return face + thin_rear + swell_body


def cavity(parameters: PhantomParameters) -> Field:
    """Build the main passage between septum and lateral wall, without contents."""
    wall = smooth_min(
        2.0,
        height_table(
            [-20, 2, 8, 20, 25, 29, 60], [11.5, 12.6, 13.2, 12.6, 10.5, 4.3, 3.3], 1.0
        ),
        depth_table([-14, -6, 0, 6, 14, 60], [3.8, 4.6, 5.4, 9.6, 14, 14], 1.0),
    )
    # The floor rises towards both walls as a shallow gutter.
    floor = depth_table([-12, -4, 2, 10, 55], [-0.8, -1.0, -0.8, 0.2, 1.0]) + Table(
        U, (-4, 0, 3, 6, 9, 12, 14), (5.5, 2.0, 0.5, 0.0, 0.5, 2.0, 3.5), 1.5
    )
    cribriform = ethmoid_roof(parameters) - parameters.keros_mm
    dorsum = depth_table([-18, -8, 2, 10, 18], [9, 18, 31, 40, 60], 1.5)
    roof = smooth_min(2.0, cribriform, dorsum)
    rear = height_table(
        [16, 20, 22.5, 25, 44, 80], [-60, -59, -57, -54.3, -52, -47], 1.0
    )
    passage = smooth_max(
        2.0,
        smooth_max(1.2, septum_face() - u, u - wall),
        smooth_max(3.0, floor - z, (z - roof) * 0.85),
    )
    return smooth_max(1.0, passage, smooth_max(1.0, y - 12, rear - y))


def vestibule() -> Field:
    """Build the nostril and vestibule, held open as by a nasal speculum.

    Four chains: the anatomical way up to the valve and to the olfactory cleft, and
    the two straighter ways that a speculum and a lifted nasal tip open for rigid
    instruments: inwards to the sphenoid, and flat along the floor to the pharynx.
    """
    upward = Chain(
        ((6.4, 10.5, -9), (5.9, 9, -3), (5.6, 6.5, 4.5), (5.8, 1, 10), (6, -6, 12)),
        (4.0, 3.6, 3.1, 2.8, 3.0),
    )
    inward = Chain(
        ((6.6, 15.0, -9), (6.2, 13, -2), (5.8, 8, 4), (5.4, 1, 7), (5.4, -6, 10)),
        (3.6, 3.4, 3.0, 2.5, 2.6),
    )
    flat = Chain(
        ((6.0, 17.5, -0.5), (5.7, 9.0, 1.8), (5.2, 1.0, 3.7), (5.2, -7.0, 5.5)),
        (3.6, 3.3, 3.2, 3.1),
    )
    cleft = Chain(
        ((5.4, 9, 6), (5.2, 6, 11), (5.0, 3, 16), (5.0, -5, 20)), (2.4, 2.3, 2.0, 2.2)
    )
    return smooth_max(0.8, smooth_min(2.5, upward, inward, flat, cleft), 1.3 - u)


def nasopharynx() -> Field:
    """Build the nasopharynx, symmetrical about the midline, with tube and torus."""
    roof = depth_table([57, 66, 72, 80], [22.5, 20, 15, 2], 1.5)
    arch = height_table([-12, -4, 4, 12, 20, 26], [5.6, 1.4, 0, 1.4, 5.6, 8], 2.0)
    bend = Table(
        U, (-18, -13, -8, -4, 0, 4, 8, 13, 18), (8, 5.9, 2.2, 0.6, 0, 0.6, 2.2, 5.9, 8)
    )
    box = smooth_max(2.5, abs(u) - 13.0, smooth_max(3.0, -30.0 - z, (z - roof) * 0.8))
    box = smooth_max(4.0, box, smooth_max(1.5, y + 56, arch + bend - 74.5 - y))
    torus = _both_sides(
        ((13.6, -60.6, 10.2), (12.6, -64.2, 10.3), (12.4, -66.2, 7.2), (13, -66.6, 2)),
        (1.5, 2.1, 2.4, 1.6),
    )
    orifice = _both_sides(((11.6, -61.6, 6.2), (17, -63.5, 7.5)), (2.3, 0.9))
    fossa = _both_sides(((12, -70.5, 8), (16, -73, 9)), (2.4, 1.0))
    box = smooth_max(1.2, box, -Mark(Row.TORUS, torus))
    return smooth_min(1.0, smooth_min(0.8, box, orifice), fossa)


def _both_sides(points: tuple[Point, ...], radii: tuple[float, ...]) -> Field:
    mirrored = tuple((-p[0], p[1], p[2]) for p in points)
    return smooth_min(0.0, Chain(points, radii), Chain(mirrored, radii))


RIM_NORMAL = (0.0, 0.8, -0.6)
RIM_OFFSET_MM = 12.64
"""The nostrils' plane, points with ``RIM_NORMAL . p > RIM_OFFSET_MM`` below the nose;
its slope is that of a nasal tip lifted as for surgery."""


def outside() -> Field:
    """Build the air in front of the face and below the lifted nasal tip."""
    half = abs(u)
    cheek = Table(
        U,
        (-44, -30, -20, -12, 0, 12, 20, 30, 44),
        (-13, -4, 0, 4, 5, 4, 0, -4, -13),
        3.0,
    )
    brow = height_table([28, 38, 50, 60, 70], [0, 2.0, 4.0, 7.0, 7.5], 3.0)
    ridge = height_table(
        [-2, 6, 11, 18, 31, 42, 50, 58], [16, 18, 16.5, 11, 4.5, 0.5, 0, 0], 2.0
    )
    width = height_table([0, 10, 20, 40], [0.058, 0.07, 0.1, 0.13], 3.0)
    t = half * width
    profile = smooth_max(0.6, 1.0 - t * t, 0.0)
    face = (cheek + brow + ridge * profile - y) * 0.6
    lip = height_table([-14, -9, -4], [9.0, 8.0, 8.0], 2.0)
    below = smooth_max(
        2.0, RIM_OFFSET_MM - (0.8 * y - 0.6 * z), lip - (half * half) * 0.006 - y
    )
    return smooth_min(1.5, face, below)


def nasal_air(parameters: PhantomParameters) -> Field:
    """Build the air of one side of the nose with pharynx and outside."""
    solids = turbinates(parameters)
    pharynx = Mark(Row.PHARYNX, nasopharynx() + Unevenness(1, 1.0))
    air = smooth_min(2.0, cavity(parameters), pharynx)
    air = smooth_min(2.5, air, vestibule())
    air = smooth_max(0.8, air, -solids.inferior)
    air = smooth_max(0.8, air, -solids.middle)
    air = smooth_max(0.5, air, -solids.superior)
    air = smooth_max(0.8, air, -solids.uncinate)
    if parameters.uncinectomy:
        opened = Chain(
            ((8.2, -17, 25), (9.2, -21, 24), (9.8, -26, 23.6), (8.6, -31, 22)),
            (1.5, 2.2, 2.5, 2.0),
        )
        air = smooth_min(1.0, air, opened)
    superior_meatus = Chain(
        ((3.2, -46, 31), (4.6, -44, 32.5), (6.2, -42, 33.5)), (1.5, 1.5, 1.3)
    )
    air = smooth_min(0.8, air, superior_meatus)
    air = air + Unevenness(0, 1.0)
    return smooth_min(2.0, air, Mark(Row.OUTSIDE, outside()))
