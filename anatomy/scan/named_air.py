"""The paranasal sinuses of a scanned head, named by where they lie about the nose.

Air is parted at its necks, as at ostia, and each piece is named by its middle in the
nose's own frame. Bounds are of adults: the nasal floor is 45 to 60 mm long and 40 to 48
mm below the cribriform plate; the sphenoid's face stands above the choana; the frontal
sinus begins above the nasofrontal beak, 50 to 55 mm over the floor; ethmoid cells fill
6 to 20 mm from the midline between them. Nothing is named by what it looks like.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.scan.airways import CAVITY_MM3, Airways, part_middles
from anatomy.scan.chambers import SINUS_ASIDE_MM, AirSpaces, side_of
from anatomy.scan.midplane import Midplane
from anatomy.scan.nose_frame import NoseFrame
from anatomy.scan.scan import inside
from anatomy.tissue import Label, Side
from renderers.scene.volume import Volume
from system import simple_itk

NECK_MM = 0.6
"""Spaces whose ball is so much wider than that of the neck between them are two."""

AROUND_MM = ((-45.0, 45.0), (-90.0, 45.0), (-25.0, 95.0))
"""Left, back and up from the choana's floor: where sinuses are looked for."""

# aside, back and up of a piece's middle, mm, in the order in which they are tried
PLACES: tuple[tuple[str, tuple[tuple[float, float], ...]], ...] = (
    ("sphenoid", ((0.0, 25.0), (3.0, 45.0), (18.0, 55.0))),
    ("frontal", ((0.0, 35.0), (-75.0, -30.0), (52.0, 95.0))),
    ("maxillary", ((15.0, 45.0), (-60.0, 2.0), (-20.0, 24.0))),
    ("maxillary", ((17.0, 45.0), (-60.0, 2.0), (24.0, 32.0))),
    ("ethmoid", ((6.0, 20.0), (-55.0, 3.0), (23.0, 56.0))),
)

LAMELLA_MM = -18.0
"""Back of the choana: cells in front of the basal lamella count as anterior ones."""

LEAST_MM3 = 100.0
"""A sinus of less air is not listed, and its air stays without a name."""

PHARYNX_MM = 24.0
"""Passages behind the choana and lower than this are the nasopharynx."""

SINUS_NAMES = ("maxillary", "frontal", "ethmoid", "sphenoid")

BY_PLACE = "named by place; not checked by a person"

NO_FRAME = (
    "the nasal floor, septum and choana were not found: no sinus is named, all stay "
    "air without a name"
)


@dataclass(frozen=True, slots=True)
class Sinus:
    """Describe one sinus; name: of `SINUS_NAMES`, "" for air that was not named.

    is_open: some of it is one air with the nasal passages in this scan.
    """

    name: str
    side: Side
    center_mm: NDArray[np.float64]
    volume_ml: float
    is_open: bool

    def __str__(self) -> str:
        """Name it with its side."""
        side = "" if self.side is Side.MIDLINE else f" {self.side.name.lower()}"
        return f"{self.name or 'not named'}{side}"


@dataclass(frozen=True, slots=True)
class NamedAir:
    """A head's inner air under the phantom's label numbers.

    labels: uint8 `Label`. sides: uint8 `Side` of the sinuses that have a name: a septum
    between two may stand far beside the midplane. sinuses: those with a name, right
    before left, then spaces without one, largest first. confidence: how they came to
    their names. frame: None where it was not found.
    """

    labels: Volume
    sides: Volume
    sinuses: tuple[Sinus, ...]
    confidence: str
    frame: NoseFrame | None


def name_sinuses(
    airways: Airways,
    spaces: AirSpaces,
    distance: Volume,
    midplane: Midplane,
    frame: NoseFrame | None,
    scanned: Volume,
) -> NamedAir:
    """Name the air of a head.

    distance: signed mm to the air surface, negative in air, on the airways' grid. Air
    apart from the passages that lies in no sinus's place stays `Label.UNNAMED_AIR`.
    frame: None leaves all of it so. scanned: the scan as it was taken; beyond it
    nothing is air of the head.
    """
    inner = np.asarray(airways.labels.values) > 0
    voxels = np.nonzero(inner)
    points = distance.origin_mm + np.stack(voxels[::-1], 1) * distance.spacing_mm
    inner[voxels] = inside(scanned, points, -0.5)
    closed = inner & (np.asarray(airways.labels.values) > 1)
    labels = np.where(inner, np.uint8(Label.NASAL_AIR), np.uint8(0))
    labels[inner & ~spaces.passages()] = Label.UNNAMED_AIR
    labels[closed] = Label.UNNAMED_AIR
    sides = np.zeros(labels.shape, np.uint8)
    named: list[Sinus] = []
    if frame is not None:
        window = _window(distance, frame)
        within = (labels[window], sides[window], closed[window])
        _name_pieces(within, distance, window, frame)
        named = _listed(labels, sides, closed, distance)
    rest = _unnamed(labels, closed, distance, midplane)
    order = sorted(named, key=lambda s: (SINUS_NAMES.index(s.name), int(s.side)))
    confidence = NO_FRAME if frame is None else BY_PLACE
    return NamedAir(
        distance.with_values(labels, 0.0),
        distance.with_values(sides, 0.0),
        (*order, *rest),
        confidence,
        frame,
    )


def _window(distance: Volume, frame: NoseFrame) -> tuple[slice, slice, slice]:
    """Return the part of the grid about the nose."""
    ends = np.array(np.meshgrid(*AROUND_MM)).reshape(3, 8).T @ frame.axes
    ends = (ends + frame.origin_mm - distance.origin_mm) / distance.spacing_mm
    shape = np.array(distance.shape[::-1])
    low = np.clip(np.floor(ends.min(axis=0)).astype(int), 0, shape - 1)
    high = np.clip(np.ceil(ends.max(axis=0)).astype(int) + 1, low + 1, shape)
    x, y, z = (slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
    return z, y, x


def _name_pieces(
    within: tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.bool_]],
    distance: Volume,
    window: tuple[slice, slice, slice],
    frame: NoseFrame,
) -> None:
    """Part the air of a window at its necks; write labels and sides of its pieces."""
    labels, sides, closed = within
    start = np.array([s.start for s in window[::-1]])
    inner = labels > 0
    pieces = _pieces(distance.values[window], inner)
    where = np.nonzero(inner)
    numbers = pieces[where]
    points = distance.origin_mm + distance.spacing_mm * (
        start + np.stack(where[::-1], axis=1)
    )
    places = frame.places(points)
    counts = np.maximum(np.bincount(numbers), 1)
    middles = np.stack(
        [np.bincount(numbers, places[:, axis]) / counts for axis in range(3)], axis=1
    )
    names = _names(middles)
    of = {
        "maxillary": np.full(len(middles), Label.MAXILLARY_AIR),
        "frontal": np.full(len(middles), Label.FRONTAL_AIR),
        "sphenoid": np.full(len(middles), Label.SPHENOID_AIR),
        "ethmoid": np.where(
            middles[:, 1] < LAMELLA_MM,
            Label.ANTERIOR_ETHMOID_AIR,
            Label.POSTERIOR_ETHMOID_AIR,
        ),
    }
    found = labels[where]
    for name, label in of.items():
        marked = (names == name)[numbers]
        found[marked] = label[numbers[marked]]
    # beside the nose, but in no sinus's place
    far = np.abs(middles[:, 0]) > SINUS_ASIDE_MM
    is_stray = (names == "") & far & (middles[:, 2] > PHARYNX_MM)
    found[is_stray[numbers]] = Label.UNNAMED_AIR
    nameless = (names == "")[numbers] & ~closed[where] & (found == Label.UNNAMED_AIR)
    found[nameless & ~far[numbers]] = Label.NASAL_AIR
    throat = (found == Label.NASAL_AIR) & (places[:, 1] > 0)
    found[throat & (places[:, 2] < PHARYNX_MM)] = Label.NASOPHARYNX_AIR
    labels[where] = found
    is_left = middles[:, 0] > 0
    side = np.where(is_left, Side.LEFT, Side.RIGHT).astype(np.uint8)
    sides[where] = np.where((names != "")[numbers], side[numbers], 0)


def _pieces(depth: NDArray[np.float32], inner: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Number the basins of a signed distance, parted where air is narrow."""
    sitk = simple_itk()
    image = sitk.GetImageFromArray(np.where(inner, depth, np.float32(1)))
    basins = sitk.MorphologicalWatershed(image, NECK_MM, False)
    numbers = np.where(inner, sitk.GetArrayFromImage(basins), 0)
    result: NDArray[np.int32] = numbers.astype(np.int32)
    return result


def _names(middles: NDArray[np.float64]) -> NDArray[np.str_]:
    """Name the place of each middle ``(n, 3)``; "" for none."""
    names = np.full(len(middles), "", dtype="<U12")
    aside = np.column_stack([np.abs(middles[:, 0]), middles[:, 1:]])
    for name, bounds in PLACES:
        low, high = np.array(bounds).T
        here = np.all((aside >= low) & (aside < high), axis=1)
        names[here & (names == "")] = name
    return names


_LABELS = {
    "maxillary": (Label.MAXILLARY_AIR,),
    "frontal": (Label.FRONTAL_AIR,),
    "ethmoid": (Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR),
    "sphenoid": (Label.SPHENOID_AIR,),
}


def _listed(
    labels: NDArray[np.uint8],
    sides: NDArray[np.uint8],
    closed: NDArray[np.bool_],
    distance: Volume,
) -> list[Sinus]:
    """List the named sinuses; takes the name from what is too small, in place."""
    spacing = float(distance.spacing_mm[0])
    found = []
    for name, values in _LABELS.items():
        for side in (Side.RIGHT, Side.LEFT):
            here = np.isin(labels, values) & (sides == side)
            voxels = np.argwhere(here)
            if len(voxels) * spacing**3 < LEAST_MM3:
                labels[here] = Label.UNNAMED_AIR
                continue
            center = distance.origin_mm + voxels.mean(axis=0)[::-1] * spacing
            volume = len(voxels) * spacing**3 / 1000
            is_open = not closed[here].all()
            found.append(Sinus(name, side, center, volume, is_open))
    return found


def _unnamed(
    labels: NDArray[np.uint8],
    closed: NDArray[np.bool_],
    distance: Volume,
    midplane: Midplane,
) -> list[Sinus]:
    """List the air spaces that got no name, largest first."""
    spacing = float(distance.spacing_mm[0])
    parts, count = ndimage.label(labels == Label.UNNAMED_AIR)
    sizes = np.bincount(parts.ravel(), minlength=count + 1) * spacing**3
    sizes[0] = 0
    middles = part_middles(parts)
    found = []
    for part in np.argsort(-sizes, kind="stable").tolist():
        if sizes[part] < CAVITY_MM3:
            break
        center = distance.origin_mm + middles[part][::-1] * spacing
        side = side_of(float(midplane.aside(center)))
        is_open = not closed[parts == part].all()
        found.append(Sinus("", side, center, float(sizes[part]) / 1000, is_open))
    return found
