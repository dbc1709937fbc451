"""Make ``first_flight.path.json``: a 25 s probe path through the right nose.

    python examples/make_first_flight.py

The way goes nostril, inferior turbinate, middle meatus, sphenoethmoidal recess,
nasopharynx and back. Waypoints are named landmarks of the default head plus a standoff;
between them `shaft_planner.py` bends the motion so that the straight shaft of a
2.7 mm scope stays clear of tissue. A suction tube comes along beside the scope. Then a
hand is added: physiological tremor of 8-12 Hz and a slow drift.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from shaft_planner import Keepout, ShaftPlanner, Waypoint

from anatomy import PhantomParameters, sinus_phantom
from devices import ProbePath, save_probe_path
from renderers.scene import Volume
from scenarios import Endoscope, shaft_clearance, tip_frame

Floats = NDArray[np.float64]

DURATION_S = 25.0
RATE_HZ = 100.0
SCOPE = Endoscope(diameter_mm=2.7)
SUCTION_MM = 2.4
HANDLE_MM = 130.0
"""Distance from tip to the point by which a tool is steered."""

TREMOR_HZ, DRIFT_HZ = (8.3, 9.7, 11.4), (0.31, 0.57, 0.93)
TREMOR_MM = 0.03
"""Tremor of a scope resting in the nostril; a free hand shakes three times as much."""

# time, landmark, standoff from it in LPS mm: where the tip goes
STATIONS: tuple[tuple[float, str, tuple[float, float, float]], ...] = (
    (0.0, "nostril, right", (0.0, -7.0, -4.0)),
    (2.0, "nostril, right", (0.0, -4.0, -3.0)),
    (4.0, "nasal valve, right", (0.0, 0.5, -2.5)),
    (5.5, "nasal valve, right", (0.0, 1.0, -2.0)),
    (8.0, "middle turbinate head, right", (1.4, -8.5, -6.0)),
    (10.0, "middle turbinate head, right", (1.4, -6.0, -5.0)),
    (12.5, "sphenoethmoidal recess, right", (-0.5, -14.0, -9.0)),
    (14.5, "sphenoethmoidal recess, right", (0.2, -4.0, -2.0)),
    (15.5, "sphenoethmoidal recess, right", (0.2, -3.5, -2.0)),
    (17.0, "choana, right", (1.7, -26.0, 2.0)),
    (19.5, "choana, right", (2.0, -6.0, -1.5)),
    (20.5, "choana, right", (2.0, -5.0, -1.5)),
    (23.0, "nasal valve, right", (0.0, 4.0, -3.0)),
    (25.0, "nostril, right", (0.0, -7.0, -4.0)),
)
ENTRY = "nostril, right"
SILL_MM = np.array([1.2, 2.0, 7.0])
"""From the entry's landmark to the point over the nasal sill through which a straight
scope reaches everything behind the valve."""

# time and how far the suction's tip is ahead of the scope's, mm
SUCTION_AHEAD = ((0.0, -70.0), (5.5, -70.0), (8.0, 7.0), (10.3, 9.0), (12.5, -70.0))
SUCTION_BELOW_MM = 2.6
SUCTION_RIGHT_MM = -1.5
"""Where the tube lies beside the scope, in the picture's directions."""


def main() -> None:
    """Plan, shake, check and save."""
    phantom = sinus_phantom(PhantomParameters(), spacing_mm=0.5)
    places = {key: mark.position_mm for key, mark in phantom.landmarks.items()}
    planner, tips, handles = plan_scope(phantom.distance, places)
    suction = plan_suction(phantom.distance, planner, tips, handles)
    times = np.arange(int(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    basis = planner.basis(times)
    random = np.random.default_rng(1)
    tip = basis @ tips + tremor(times, random)
    axis = unit(tip - (basis @ handles + 3 * tremor(times, random)))
    suction_tip = basis @ suction[0] + tremor(times, random)
    suction_axis = unit(suction_tip - basis @ suction[1])
    path = ProbePath(
        name="first flight",
        t_s=times,
        tip_mm=tip.round(4),
        axis=unit(axis.round(6)),
        roll_deg=(8.0 * np.sin(2 * np.pi * times / 11.0)).round(3),
        instrument_tip_mm=suction_tip.round(4),
        instrument_axis=unit(suction_axis.round(6)),
        buttons=np.zeros(len(times), np.int64),
        source="examples/make_first_flight.py",
    )
    gaps = clearances(
        phantom.distance, path.tip_mm, path.axis, SCOPE.diameter_mm, 110.0
    )
    print(f"length {path.length_mm:.0f} mm, smallest gap {min(gaps):.2f} mm")
    for time_s, name, _ in STATIONS:
        off = np.linalg.norm(path.sample(time_s).tip_mm - places[name])
        gap = gaps[int(time_s * RATE_HZ)]
        print(f"{time_s:5.1f} s  {off:5.1f} mm from {name}, gap {gap:.2f} mm")
    tube = path.instrument_tip_mm, path.instrument_axis, SUCTION_MM, 70.0
    print(
        f"suction tube: smallest gap {min(clearances(phantom.distance, *tube)):.2f} mm"
    )
    if min(gaps) <= 0:
        raise SystemExit("the shaft touches tissue; nothing was saved")
    save_probe_path(path, Path(__file__).with_name("first_flight.path.json"))


def clearances(
    distance: Volume, tips: Floats, axes: Floats, diameter_mm: float, reach_mm: float
) -> list[float]:
    """Return a shaft's gap to tissue at each moment, mm."""
    frames = [tip_frame(tip, axis) for tip, axis in zip(tips, axes, strict=True)]
    radius = diameter_mm / 2
    return [shaft_clearance(distance, f, radius, reach_mm).gap_mm for f in frames]


def plan_scope(
    distance: Volume, places: dict[str, Floats]
) -> tuple[ShaftPlanner, Floats, Floats]:
    """Plan tip and handle of the scope: the planner and ``(controls, 3)`` twice."""
    planner = ShaftPlanner(
        distance,
        duration_s=DURATION_S,
        radius_mm=SCOPE.diameter_mm / 2,
        margin_mm=0.4,
        reach_mm=115.0,
    )
    waypoints = []
    for time_s, name, standoff in STATIONS:
        tip = places[name] + np.array(standoff)
        sill = places[ENTRY] + SILL_MM
        inside = tip[1] > sill[1] + 5.0
        back = unit(sill - tip) if inside else np.array([0.0, -0.83, -0.55])
        waypoints.append(Waypoint(time_s, tip, tip + HANDLE_MM * back))
    return (planner, *planner.plan(waypoints))


def plan_suction(
    distance: Volume, scope: ShaftPlanner, tips: Floats, handles: Floats
) -> tuple[Floats, Floats]:
    """Plan the suction tube: beside the scope, drawn back when it is not needed."""
    planner = ShaftPlanner(
        distance,
        duration_s=DURATION_S,
        radius_mm=SUCTION_MM / 2,
        margin_mm=1.0,
        reach_mm=75.0,
    )
    basis = scope.basis(scope.moments)
    keepout = Keepout(
        basis @ tips, basis @ handles, (SCOPE.diameter_mm + SUCTION_MM) / 2 + 0.3
    )
    times, ahead = np.array(SUCTION_AHEAD).T
    waypoints = []
    for time_s in np.arange(0.0, DURATION_S + 0.25, 0.5):
        row = scope.basis(np.array([time_s]))
        tip, axis = (row @ tips)[0], unit(row @ tips - row @ handles)[0]
        _, right, up, _ = SCOPE.camera(tip_frame(tip, axis), 0.0, (8, 8)).frame
        beside = SUCTION_RIGHT_MM * right - SUCTION_BELOW_MM * up
        goal = tip + np.interp(time_s, times, ahead) * axis + beside
        # the hands hold the two tools apart: the tube comes from below
        handle = goal - HANDLE_MM * axis + 5.0 * beside
        waypoints.append(Waypoint(time_s, goal, handle))
    return planner.plan(waypoints, keepout)


def tremor(times: Floats, random: np.random.Generator) -> Floats:
    """Give a hand's shake ``(n, 3)``: three tremor lines and a slow drift."""
    phase = random.uniform(0, 2 * np.pi, (2, 3, 3))
    fast, slow = (
        sum(np.sin(2 * np.pi * hertz * times[:, None] + at) for hertz, at in lines)
        for lines in map(zip, (TREMOR_HZ, DRIFT_HZ), phase)
    )
    result: Floats = TREMOR_MM * np.sqrt(2 / 9) * (fast + slow)
    return result


def unit(vectors: Floats) -> Floats:
    """Scale to length one along the last axis."""
    result: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


if __name__ == "__main__":
    main()
