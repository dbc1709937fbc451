"""An arm that reports its motion at any rate, for measuring whoever reads it.

    python -m benchmarks.suites.arm_pump --hz 823 --log FILE

prints its port's name. Signing on and questions go to the emulated arm; once asked for
reports it sends a packet every 1/hz seconds, faster than a real line could if need be,
and notes when. On the end of its standard input it writes the notes: pairs of float64,
the timer's ticks counted on and the monotonic time just before the packet was written:
a reader on another core may have it before the writer looks at the clock again.
"""

import argparse
import os
import select
import sys
import time
import tty
from array import array

from devices.microscribe.emulator.firmware import ArmFirmware, FirmwareState
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.emulator.packet import Reading, standard_packet
from devices.microscribe.kinematics.profiles import DX40937

TICKS_PER_S = 900.0


def main() -> int:
    """Serve one client until the standard input ends."""
    parser = argparse.ArgumentParser("arm_pump", description=__doc__)
    parser.add_argument("--hz", type=float, required=True)
    parser.add_argument("--log", required=True)
    options = parser.parse_args()
    master, client = os.openpty()
    tty.setraw(client)
    os.set_blocking(master, False)
    print(os.ttyname(client), flush=True)
    notes = pump(master, sys.stdin.fileno(), options.hz)
    with open(options.log, "wb") as file:
        notes.tofile(file)
    return 0


def pump(master: int, watched: int, hz: float) -> "array[float]":
    """Serve ``master`` until ``watched`` ends; return the notes."""
    begin = time.monotonic()
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), begin)
    counts, codes = DX40937.home_counts, DX40937.encoder_codes
    notes = array("d")
    due, last = begin, -1
    while True:
        streaming = firmware.state is FirmwareState.MOTION
        left = max(due - time.monotonic(), 0.0) if streaming else 0.1
        ready = select.select((master, watched), (), (), left)[0]
        if watched in ready and not os.read(watched, 4096):
            return notes
        now = time.monotonic()
        if master in ready:
            for byte in os.read(master, 4096):
                os.write(master, firmware.receive(bytes((byte,)), now))
            due = now
        elif streaming and now >= due:
            ticks = int((now - begin) * TICKS_PER_S)
            if ticks == last:
                # Ticks tell packets apart, and no arm is ahead of its clock.
                due = begin + (ticks + 1) / TICKS_PER_S
                continue
            last = ticks
            packet = standard_packet(0x23, Reading(counts, 0), ticks % 16384, codes)
            try:
                written_s = time.monotonic()
                os.write(master, packet)
                notes.extend((float(ticks), written_s))
            except BlockingIOError:
                # The reader is a terminal's buffer behind: this packet is lost.
                notes.extend((float(ticks), float("nan")))
            due = max(due + 1.0 / hz, now - 0.02)


if __name__ == "__main__":
    sys.exit(main())
