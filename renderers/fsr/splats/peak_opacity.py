"""How opaque a splat's centre must be for the optical depth that it stands for.

Splats are blended one by one, so the peak that gives a sheet of them the depth t has to
be solved for (`renderers.fsr.footprint`). Over t it is so smooth that six products give
it: ``t (p0 + t (p1 + ... t p5))`` is within 3e-7 of the solution in single precision,
least maximum error. Over the opacity, 1 - exp(-t), it ends with a steep kink: a table
of 1024 lines is off by 6e-4 there.
"""

import numpy as np

PEAK = tuple(
    np.float32(p)
    for p in (
        4.65638346e-01,
        -5.58564020e-02,
        1.76992574e-03,
        -5.26490919e-05,
        -1.64888089e-05,
        4.96536370e-06,
    )
)
"""Of the lowest power first, for `SIGMA_PER_SPACING`."""

DEEPEST = np.float32(3.4)
"""The optical depth from which on a peak is one: denser a sheet cannot be."""
