"""Make ``first_operation.path.json``: an uncinectomy and a wider maxillary ostium.

    python examples/make_first_operation.py

Eighteen seconds in the right nose of the default head. A 30-degree scope looks down and
aside at the middle meatus and rests there. Straight forceps take the uncinate process
in seven bites, from its front backwards, the last of them at the natural ostium; then a
microdebrider trims the rim. All places are named landmarks plus an offset. The hand has
the tremor of the first flight.
"""

from pathlib import Path

import numpy as np
from make_first_flight import SILL_MM, tremor, unit
from numpy.typing import NDArray

from anatomy import PhantomParameters, sinus_phantom
from devices import ProbePath, save_probe_path
from paravol.inputs.pose_completer import PATH_SUCTION, PATH_WORK

Floats = NDArray[np.float64]

RATE_HZ = 100.0
ENTRY = "nostril, right"
ROLL_DEG = -125.0
"""Of the light post: the scope looks down and to the patient's right."""

# time, standoff of the scope's tip from the middle turbinate's head, LPS mm
SCOPE = (
    (0.0, (1.4, -8.5, -6.0)),
    (1.0, (1.4, -8.5, -6.0)),
    (2.5, (-0.8, -6.5, -3.6)),
    (19.0, (-0.8, -6.5, -3.6)),
)
HAND_MM = np.array([2.8, 0.0, 6.5])
"""From the entry's landmark to the point through which the instruments come."""

# tips of the forceps, from the maxillary ostium, LPS mm
BITES = (
    (3.0, -4.5, 1.5),
    (3.1, -4.0, 4.0),
    (2.9, -2.0, 2.2),
    (2.6, -1.5, 0.3),
    (2.3, -0.5, -0.8),
    (1.9, 0.8, -1.8),
    (1.2, 0.5, -1.0),
)
FIRST_BITE_S, BITE_S = 3.0, 1.5
CLOSED_S, OPEN_S = 0.75, 1.15
"""Of each bite: when the jaws are told to close, and to open."""
BACK_MM = 7.0
"""How far the forceps are drawn back between two bites."""

TRIM_S = FIRST_BITE_S + BITE_S * len(BITES)
# time after that, tip of the debrider from the maxillary ostium, whether it runs
TRIM = (
    (0.0, (7.0, -16.0, -7.0), False),
    (0.8, (2.8, -4.0, -1.0), False),
    (1.0, (2.2, -2.5, -1.0), True),
    (1.8, (1.4, -1.0, -2.5), True),
    (2.6, (2.0, -2.5, -3.0), True),
    (3.2, (2.8, -4.0, -1.5), False),
    (4.0, (7.0, -16.0, -7.0), False),
)
DURATION_S = TRIM_S + 5.0


def main() -> None:
    """Put scope and tools where the tables say, shake, and save."""
    marks = sinus_phantom(PhantomParameters(), spacing_mm=0.5).landmarks
    places = {name: mark.position_mm for name, mark in marks.items()}
    times = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    random = np.random.default_rng(2)
    at_s, standoff = (np.array(column) for column in zip(*SCOPE, strict=True))
    tip = places["middle turbinate head, right"] + smooth(times, at_s, standoff)
    sill = places[ENTRY] + SILL_MM
    tip_shaken = tip + tremor(times, random)
    tool, buttons = instrument(times, places)
    shaken = tool + tremor(times, random)
    path = ProbePath(
        name="first operation",
        t_s=times,
        tip_mm=tip_shaken.round(4),
        axis=unit(unit(tip_shaken - sill).round(6)),
        roll_deg=np.full(len(times), ROLL_DEG),
        instrument_tip_mm=shaken.round(4),
        instrument_axis=unit(unit(shaken - (places[ENTRY] + HAND_MM)).round(6)),
        buttons=buttons,
        source="examples/make_first_operation.py",
        tools=((0.0, "straight forceps"), (TRIM_S, "microdebrider")),
    )
    save_probe_path(path, Path(__file__).with_name("first_operation.path.json"))


def instrument(
    times: Floats, places: dict[str, Floats]
) -> tuple[Floats, NDArray[np.int64]]:
    """Return the tips ``(n, 3)`` and the pedals ``(n,)`` of the instruments."""
    ostium, hand = places["maxillary ostium, right"], places[ENTRY] + HAND_MM
    keys: list[tuple[float, Floats]] = []
    buttons = np.zeros(len(times), np.int64)
    for number, offset in enumerate(BITES):
        begin = FIRST_BITE_S + BITE_S * number
        there = ostium + np.array(offset)
        back = there - BACK_MM * unit(there - hand)
        keys += [(begin, back), (begin + 0.6, there), (begin + OPEN_S, there)]
        buttons[(times >= begin + CLOSED_S) & (times < begin + OPEN_S)] = PATH_WORK
    keys.insert(0, (0.0, keys[0][1] - 12.0 * unit(keys[0][1] - hand)))
    keys.append((TRIM_S - 0.01, ostium + np.array(TRIM[0][1])))
    for after_s, offset, runs in TRIM:
        keys.append((TRIM_S + after_s, ostium + np.array(offset)))
        if runs:
            here = (times >= TRIM_S + after_s) & (times < TRIM_S + after_s + 0.8)
            buttons[here] = PATH_WORK
    buttons[times >= TRIM_S] |= PATH_SUCTION
    at_s, tips = (np.array(column) for column in zip(*keys, strict=True))
    return smooth(times, at_s, tips), buttons


def smooth(times: Floats, at_s: Floats, points: Floats) -> Floats:
    """Go from point to point ``(n, 3)``, at rest in each: minimum jerk."""
    place = np.clip(np.searchsorted(at_s, times, side="right") - 1, 0, len(at_s) - 2)
    u = np.clip((times - at_s[place]) / (at_s[place + 1] - at_s[place]), 0.0, 1.0)
    share = (u**3 * (10 - 15 * u + 6 * u**2))[:, None]
    way: Floats = points[place] + share * (points[place + 1] - points[place])
    return way


if __name__ == "__main__":
    main()
