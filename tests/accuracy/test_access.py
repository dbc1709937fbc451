"""The law that makes the phantom fit for training: rigid scopes reach their targets."""

import numpy as np
import pytest

from anatomy.frame import lps_from_ras
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.tissue import Side

MARGIN_MM = 0.15


@pytest.fixture(scope="module")
def nose() -> Phantom:
    """The default head's nasal cavity alone, at the default spacing."""
    box = ((-13.0, 13.0), (-23.0, 62.0), (-12.0, 40.0))
    return build_phantom(PhantomParameters(), 0.5, field_mm=box)


# tip as (u, y, z), slope towards the nostril in degrees, shaft radius
WAYS = {
    "inferior turbinate": ((5.3, 1.5, 9.5), 2.0),
    "middle meatus": ((5.0, -6.0, 16.8), 2.0),
    "sphenoethmoidal recess": ((3.1, -43.0, 27.2), 1.35),
    "nasopharynx": ((3.8, -45.0, 9.6), 2.0),
}


def best_clearance(
    phantom: Phantom, tip: np.ndarray, side: Side
) -> tuple[float, np.ndarray]:
    """Search the straight shafts from `tip` to below the nostril for the widest."""
    sign = 1.0 if side == Side.RIGHT else -1.0
    slopes = np.radians(np.arange(4.0, 58.0, 1.0))
    turns = np.radians(np.arange(-3.0, 9.0, 0.75))
    slope, turn = (a.ravel() for a in np.meshgrid(slopes, turns))
    back = np.stack(
        [np.sin(turn) * np.cos(slope), np.cos(turn) * np.cos(slope), -np.sin(slope)], 1
    )
    along = np.arange(0.0, 75.0, 0.5)
    points = tip + along[None, :, None] * back[:, None, :]
    # Beyond the rim there is nothing but the open air below the nose.
    free = points @ np.array([0.0, 0.8, -0.6]) > 17.0
    world = lps_from_ras(points * np.array([sign, 1.0, 1.0]))
    distance = np.where(free, -50.0, phantom.distance.sample(world))
    clearance = -distance.max(axis=1)
    best = int(np.argmax(clearance))
    return float(clearance[best]), back[best]


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
@pytest.mark.parametrize("target", WAYS)
def test_a_straight_shaft_reaches_the_target_through_air(
    nose: Phantom, target: str, side: Side
) -> None:
    tip, radius = WAYS[target]
    clearance, _ = best_clearance(nose, np.array(tip), side)
    assert clearance >= radius + MARGIN_MM


def test_a_thick_scope_stays_away_from_the_sphenoid_ostium(nose: Phantom) -> None:
    # Un-operated, a 4 mm scope sees the recess from afar; it must not fit in.
    for depth in (-50.0, -47.0):
        tip = np.array([3.4, depth, 32.0])
        assert best_clearance(nose, tip, Side.RIGHT)[0] < 2.0
