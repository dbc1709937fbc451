"""The records that compiled code of force devices shares with Python.

Lengths in mm, forces in N, times in ns of the machine's monotonic clock, frames as the
device has them: a matrix takes the tip's frame (+z from the tip back up the shaft) into
the device's.
"""

import numpy as np

READING = np.dtype(
    [
        # counts the measurements: it stands still while nothing new is measured
        ("count", np.int64),
        ("position_mm", np.float64, (3,)),
        ("rotation", np.float64, (3, 3)),
        # bit 0 right pedal, bit 1 left pedal
        ("buttons", np.int64),
    ],
    align=True,
)
"""What a device measured."""

NEW, NO_NEWS, GONE = 1, 0, -1
"""What reading a device returns: a new measurement, none, or that it is not there."""

GUARD = np.dtype(
    [
        ("limit_n", np.float64),
        ("ramp_ns", np.int64),
        ("silence_ns", np.int64),
        ("speed_mm_s", np.float64),
        # what follows changes with every force
        ("fault", np.int64),
        ("faults", np.int64, (5,)),
        ("heard_ns", np.int64),
        ("seen_ns", np.int64),
        ("seen_mm", np.float64, (3,)),
        ("is_seen", np.int64),
        ("ramp_from_ns", np.int64),
        ("is_ramping", np.int64),
    ],
    align=True,
)
"""What the guard may let through, and what it has seen."""

NO_FAULT, SILENT, AWAY, LYING, NO_FORCE = range(5)
"""Why a force is zero: no poses, no device, a pose that cannot be, no number."""

FAULT_TEXTS = (
    "none",
    "the device is silent",
    "the device is away",
    "the device measures what cannot be",
    "the force is no number",
)

MOST_DELAY = 64
"""Sub-steps that a command of the emulated head may be under way, at most."""

HEALTHY, STUCK, SATURATED, MUTE, LIAR, UNPLUGGED = range(6)

HEAD_FAULTS = ("none", "stuck", "saturated", "silent", "lying", "unplugged")
"""Names of what an emulated head may suffer from, in the order of their numbers."""

HEAD = np.dtype(
    [
        # the model
        ("mass_kg", np.float64),
        ("coulomb_n", np.float64),
        ("viscous_ns_m", np.float64),
        ("hand_n_m", np.float64),
        ("hand_ns_m", np.float64),
        ("limit_n", np.float64),
        ("quantum_mm", np.float64),
        ("delay_steps", np.int64),
        ("step_ns", np.int64),
        ("watchdog_ns", np.int64),
        ("measures_every_ns", np.int64),
        # the fault
        ("fault", np.int64),
        ("fault_from_ns", np.int64),
        ("fault_until_ns", np.int64),
        # where the hand goes: written by another thread, between odd and even numbers
        ("goal_number", np.int64, (1,)),
        ("goal_mm", np.float64, (3,)),
        ("goal_rotation", np.float64, (3, 3)),
        ("goal_lasts_ns", np.int64),
        ("goal_buttons", np.int64),
        # the state
        ("taken_number", np.int64),
        ("is_held", np.int64),
        ("began_ns", np.int64),
        ("time_ns", np.int64),
        ("from_mm", np.float64, (3,)),
        ("to_mm", np.float64, (3,)),
        ("from_rotation", np.float64, (3, 3)),
        ("to_rotation", np.float64, (3, 3)),
        ("goal_ns", np.int64),
        ("lasts_ns", np.int64),
        ("hand_mm", np.float64, (3,)),
        ("position_mm", np.float64, (3,)),
        ("velocity_mm_s", np.float64, (3,)),
        ("rotation", np.float64, (3, 3)),
        ("buttons", np.int64),
        ("commanded_n", np.float64, (3,)),
        ("commanded_ns", np.int64),
        ("on_the_way_n", np.float64, (MOST_DELAY, 3)),
        ("steps", np.int64),
        ("motor_n", np.float64, (3,)),
        ("largest_n", np.float64),
        ("count", np.int64),
        ("measured_ns", np.int64),
        ("stuck_mm", np.float64, (3,)),
        ("is_stuck", np.int64),
    ],
    align=True,
)
"""The emulated head: its model, its fault, its hand and its state.

largest_n: the largest force that was ever asked of it.
"""
