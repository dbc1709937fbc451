"""The frontal sinus of one side with its recess."""

import numpy as np

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import Chain, Ellipsoid, Field, smooth_max, smooth_min, u, z
from anatomy.tissue import Side


def intersinus_lean(parameters: PhantomParameters) -> float:
    """Draw how far the septum between the frontal sinuses leans, mm at its top."""
    rng = np.random.default_rng([parameters.seed, 0x6672])
    return float(np.clip(rng.normal(0.0, 1.6), -3.5, 3.5))


def frontal(parameters: PhantomParameters, side: Side) -> Field | None:
    """Build the frontal sinus: lobes above the recess and over the orbit.

    The lobes' sizes are drawn, which scallops its upper margin; aplasia gives none.
    """
    q = parameters.scale("frontal", side)
    if q == 0:
        return None
    rng = np.random.default_rng([parameters.seed, int(side), 0x6672])
    tall, broad = np.clip(rng.normal(1.0, 0.06, 2), 0.88, 1.08)
    depth, high = q**0.5, q**0.6
    base = 56.0
    medial = Ellipsoid(
        (1.6 + 5.2 * q, -5.2, base + 8.6 * high),
        (6.9 * q, 6.3 * depth, 10.6 * high * tall),
    )
    lateral = Ellipsoid(
        (4.0 + 9.8 * q, -6.2, base + 6.6 * high),
        (9.2 * q * broad, 5.7 * depth, 7.1 * high),
    )
    crest = Ellipsoid(
        (3.0 + 7.6 * q, -4.6, base + 12.0 * high),
        (5.0 * q, 4.2 * depth, 6.0 * high),
    )
    lobes = smooth_min(1.4, medial, lateral, crest)
    # Its floor is the orbit's roof, which rises towards the side.
    lobes = smooth_max(2.0, lobes, (54.6 + (u - 8.0) * 0.22 - z) * 0.95)
    sign = 1.0 if side == Side.RIGHT else -1.0
    lean = sign * intersinus_lean(parameters) / 24.0
    septum = 0.9 + (z - base) * lean - u
    return smooth_max(1.0, lobes, septum)


def frontal_recess() -> Field:
    """Build the frontal recess with the ostium at its waist."""
    return Chain(
        (
            (8.2, -8.5, 59),
            (8.0, -11.5, 54.5),
            (7.8, -13.0, 48.5),
            (8.2, -15.5, 42.5),
            (8.6, -17.5, 38),
        ),
        (3.4, 2.4, 2.3, 2.0, 1.7),
    )
