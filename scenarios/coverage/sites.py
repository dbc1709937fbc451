"""Which part of the nose a patch of mucosa belongs to.

The air in front of it tells a sinus, the structure behind it a turbinate or the septum.
What is left of the lateral wall lies in the meatus under the turbinate that is met on
the way to the midline. Landmarks tell the rest.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from scenarios.structures import Structures

Doubles = NDArray[np.float64]

OTHER = "nasal cavity"
"""Mucosa of the nose that is in none of the others."""

SINUSES = {
    "maxillary air": "maxillary sinus",
    "frontal air": "frontal sinus",
    "anterior ethmoid air": "anterior ethmoid",
    "posterior ethmoid air": "posterior ethmoid",
    "variant cell air": "variant cells",
    "sphenoid air": "sphenoid sinus",
    "nasopharynx air": "nasopharynx",
}
"""Sites by the air in front of them."""

WALLS = {
    "inferior turbinate": "inferior turbinate",
    "middle turbinate": "middle turbinate",
    "superior turbinate": "superior turbinate",
    "septum": "septum",
    "uncinate process": "middle meatus",
    "polyp": "polyp",
    "skin": "vestibule",
}
"""Sites by the structure behind them."""

MEATUSES = {
    "inferior turbinate": "inferior meatus",
    "middle turbinate": "middle meatus",
    "superior turbinate": "superior meatus",
}
"""Sites by the turbinate that lies between them and the septum."""

PLACES = {
    "sphenoethmoidal recess": ("sphenoethmoidal recess", 6.0),
    "choana": ("choana", 8.0),
    "nasal valve": ("vestibule", 8.0),
    "nostril": ("vestibule", 8.0),
}
"""Sites by a landmark, and how near to it, mm: what no structure tells."""

CLEFT = "olfactory cleft"
CLEFT_MM = 7.0
"""The olfactory cleft is so near to the middle, and above the superior turbinate's
landmark; beside it lie the septum's and the turbinates' upper ends."""

SEPTUM_MM = 5.0
"""Walls so near to the middle that face outwards are the septum's."""

MEDIAL_MM, STEP_MM = 14.0, 0.5
"""Way towards the middle on which a turbinate is looked for."""

SIDES = ("right", "left")

SITE_NAMES = tuple(
    dict.fromkeys(
        [*MEATUSES.values(), *WALLS.values(), CLEFT]
        + [site for site, _ in PLACES.values()]
        + [*SINUSES.values(), OTHER]
    )
)
"""Sites, without their sides: ``middle meatus`` is that of both sides together, and
``middle meatus, left`` that of one."""

_FRONT_MM = (0.8, 0.4, 1.2)
_BEHIND_MM = tuple(np.arange(0.25, 3.0, 0.5).tolist())


def sites_of(
    places: Doubles, normals: Doubles, structures: Structures | None
) -> list[str]:
    """Name the site of each patch, with its side; "" outside the airway.

    places: ``(n, 3)`` on the surface, LPS mm. normals: unit, into the air. Without
    labels, or a pair of landmarks that tells the middle, all is `OTHER`.
    """
    middle = None if structures is None else middle_of(structures.landmarks)
    if structures is None or not structures.airs or middle is None:
        return [OTHER] * len(places)
    known = structures.landmarks
    front = _first(places, normals, _FRONT_MM, structures, structures.airs)
    back = _first(places, -normals, _BEHIND_MM, structures, structures.names)
    found = []
    over = _towards_middle(places, middle, structures)
    near = _near(places, middle, known)
    for n, place in enumerate(places):
        if front[n] not in (*SINUSES, "nasal air"):
            found.append("")
            continue
        is_left = place[0] > middle
        outwards = normals[n, 0] * (1.0 if is_left else -1.0)
        if not back[n] and outwards > 0.5 and abs(place[0] - middle) < SEPTUM_MM:
            # where its cartilage or bone lies deep
            back[n] = "septum"
        site = SINUSES.get(front[n]) or _nasal(
            place, back[n], over[n], near[n], known, middle
        )
        if back[n] == "septum" and abs(normals[n, 0]) > 0.3:
            # a bent septum leaves the midline, but faces its own side
            is_left = bool(normals[n, 0] > 0.0)
        found.append(f"{site}, {SIDES[int(is_left)]}")
    return found


def _nasal(
    place: Doubles,
    back: str,
    over: str,
    near: str,
    known: Mapping[str, Doubles],
    middle: float,
) -> str:
    """Name a site of the nasal cavity proper."""
    roof = known.get(f"superior turbinate, {SIDES[int(place[0] > middle)]}")
    if back == "superior turbinate":
        # it is small, and the cleft would take most of it
        return back
    is_medial = abs(place[0] - middle) <= CLEFT_MM
    if roof is not None and is_medial and place[2] > roof[2] + 2.0:
        return CLEFT
    if back == "septum":
        return back
    return near or WALLS.get(back) or MEATUSES.get(over, OTHER)


def _near(places: Doubles, middle: float, known: Mapping[str, Doubles]) -> list[str]:
    """Return the first of `PLACES` that each place lies at; "" for none."""
    names = ["", *(site for site, _ in PLACES.values())]
    found = np.zeros(len(places), np.int64)
    is_left = places[:, 0] > middle
    for code, (landmark, (_, near_mm)) in enumerate(PLACES.items(), 1):
        for side, is_here in zip(SIDES, (~is_left, is_left), strict=True):
            at = known.get(f"{landmark}, {side}")
            if at is not None:
                is_near = np.linalg.norm(places - at, axis=1) <= near_mm
                found[is_here & is_near & (found == 0)] = code
    return [names[code] for code in found]


def _first(
    places: Doubles,
    ways: Doubles,
    depths_mm: Iterable[float],
    structures: Structures,
    names: Mapping[int, str],
) -> list[str]:
    """Return the first name that is met on the way from each place; "" for none."""
    known = ["", *sorted(set(names.values()))]
    values = np.arange(max(names, default=0) + 1)
    codes = np.array([known.index(names.get(int(v), "")) for v in values])
    found = np.zeros(len(places), np.int64)
    for depth_mm in depths_mm:
        met = structures.labels.nearest(places + depth_mm * ways, -1)
        is_known = (met >= 0) & (met < len(codes))
        code = np.where(is_known, codes[np.where(is_known, met, 0)], 0)
        found = np.where(found > 0, found, code)
    return [known[code] for code in found]


def _towards_middle(
    places: Doubles, middle: float, structures: Structures
) -> list[str]:
    """Return the turbinate or septum that is met first on the way to the middle."""
    way = np.zeros((len(places), 3))
    way[:, 0] = np.where(places[:, 0] > middle, -1.0, 1.0)
    names = {
        value: name
        for value, name in structures.names.items()
        if name in MEATUSES or name == "septum"
    }
    return _first(
        places, way, np.arange(1.0, MEDIAL_MM, STEP_MM).tolist(), structures, names
    )


def middle_of(landmarks: Mapping[str, Doubles]) -> float | None:
    """Return x of the midline, mm: between the landmarks of both sides, if any."""
    pairs = [
        (place[0] + landmarks[f"{name[: -len(', left')]}, right"][0]) / 2
        for name, place in landmarks.items()
        if name.endswith(", left") and f"{name[: -len(', left')]}, right" in landmarks
    ]
    return float(np.median(pairs)) if pairs else None
