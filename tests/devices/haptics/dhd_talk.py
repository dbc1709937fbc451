"""What a test does with a library in the place of libdhd, in a process of its own."""

import ctypes

import numpy as np

from devices.haptics.force_dimension import ForceDimension, library_file
from devices.haptics.force_port import new_guard
from devices.haptics.force_records import GONE, NEW, READING
from devices.haptics.kernels.guard_force import guard_force, hear_pose

READ = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)
COMMAND = ctypes.CFUNCTYPE(
    ctypes.c_int32, ctypes.c_int64, *[ctypes.c_double] * 3, ctypes.c_int64
)


def main() -> None:
    device = ForceDimension.open()
    file = library_file()
    assert file is not None
    fake = ctypes.CDLL(file)
    told = (ctypes.c_double * 8).in_dll(fake, "told")
    ctypes.c_int.in_dll(fake, "buttons").value = 7
    assert device.name == "Force Dimension sigma.7"
    assert told[5] == 1.0
    read, command = READ(device.read_address), COMMAND(device.command_address)
    reading = np.zeros(1, READING)
    at = device.state_address, reading.ctypes.data
    assert read(*at, 0) == NEW
    np.testing.assert_allclose(reading["position_mm"][0], [10.0, -20.0, 30.0])
    turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_array_equal(reading["rotation"][0], turned)
    assert reading["buttons"][0] == 3
    guard, limit = new_guard(device.limits, 0.01), device.limits.force_n
    for tick in range(100):
        force = np.array([300.0, 0.0, 400.0])
        hear_pose(guard[0], read(*at, 0), reading[0], tick * 10**6)
        guard_force(guard[0], force, tick * 10**6)
        # a saturated motor is no device that is away
        assert command(at[0], *force, 0) == 0
    np.testing.assert_allclose(told[:4], [0.6 * limit, 0.0, 0.8 * limit, 100.0])
    assert told[4] <= limit**2 * (1 + 1e-12)
    ctypes.c_int.in_dll(fake, "gone").value = 1
    assert read(*at, 0) == GONE
    assert command(at[0], 1.0, 1.0, 1.0, 0) == GONE
    ctypes.c_int.in_dll(fake, "gone").value = 0
    device.close()
    device.close()
    assert told[:3] == [0.0, 0.0, 0.0]
    assert told[5] == 0.0
    assert told[6] == 1.0
    print(f"limit {limit:g}")


if __name__ == "__main__":
    main()
