"""The record that the force loop shares with the rest of the program."""

import numpy as np

BIN_NS, BINS = 10_000, 1000
"""Of the histogram of lateness; the last bin holds all that is later."""

LOOP = np.dtype(
    [
        # asked for by others
        ("stop", np.int64, (1,)),
        ("period_ns", np.int64),
        ("is_placed", np.int64, (1,)),
        ("world_from_device", np.float64, (3, 4)),
        # newest state, written between odd and even numbers
        ("number", np.int64, (1,)),
        ("time_ns", np.int64),
        ("count", np.int64),
        ("position_mm", np.float64, (3,)),
        ("rotation", np.float64, (3, 3)),
        ("buttons", np.int64),
        ("fault", np.int64),
        ("force_n", np.float64, (3,)),
        # how it runs
        ("last_ns", np.int64),
        ("ticks", np.int64),
        ("missed", np.int64),
        ("torn", np.int64),
        ("cost_ns", np.int64),
        ("dearest_ns", np.int64),
        ("cpu_ns", np.int64),
        ("late", np.int64, (BINS,)),
        # the loop's own
        ("pose", np.float64, (4, 4)),
        ("wanted_n", np.float64, (3,)),
    ],
    align=True,
)
"""force_n: what the device was told, in its frame. late: ticks by how late they began.
cost_ns: of all ticks; dearest_ns: of the dearest."""
