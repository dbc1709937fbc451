"""Record in processes that are killed: python -m ... FOLDER COUNT, from the root.

Prints a line of JSON for each: `added_s`, the time of the last sample that it was told
is added, and `killed_s`, how long it lived. A sample's time is the host's.
"""

import json
import os
import random
import signal
import struct
import sys
import time
from pathlib import Path

import numpy as np

from scenarios import Sample
from scenarios.bundle import FrameRecord, SampleRecord, SessionRecorder
from tests.scenarios.session_info import INFO

RATES_HZ = 1000.0, 100.0, 3.0


def record(folder: Path, rate_hz: float, told: int) -> None:
    """Record for ever, and tell of every sample after it was added."""
    begun = time.monotonic()
    with SessionRecorder(folder, INFO) as recorder:
        number = 0
        while True:
            now_s = time.monotonic() - begun
            pose = np.eye(4)
            sample = Sample(now_s, pose, 0.0, pose[0, :3], pose[1, :3], number % 128)
            recorder.add(SampleRecord.of(sample))
            os.write(told, struct.pack("<d", now_s))
            if number % 5 == 4:
                recorder.add(FrameRecord(number, number, 1.0, 0.25, "a" * 32))
            number += 1
            time.sleep(1.0 / rate_hz)


def kill_one(folder: Path, rate_hz: float, after_s: float) -> dict[str, float]:
    """Start one, kill it; the pipe holds 64 KiB and is read all along."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        record(folder, rate_hz, writing)
    os.close(writing)
    begun = time.monotonic()
    told = b""
    os.set_blocking(reading, False)
    while time.monotonic() - begun < after_s:
        time.sleep(0.01)
        told += _there(reading)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    killed_s = time.monotonic() - begun
    told += _there(reading)
    os.close(reading)
    (added_s,) = struct.unpack("<d", told[-8:])
    return {"added_s": added_s, "killed_s": killed_s}


def _there(reading: int) -> bytes:
    parts = b""
    while True:
        try:
            part = os.read(reading, 1 << 16)
        except BlockingIOError:
            return parts
        if not part:
            return parts
        parts += part


if __name__ == "__main__":
    place, kills = Path(sys.argv[1]), int(sys.argv[2])
    for number in range(kills):
        found = kill_one(
            place / f"{number}.paravol",
            RATES_HZ[number % len(RATES_HZ)] if kills > 2 else RATES_HZ[1 + number],
            random.uniform(0.7, 1.8),
        )
        print(json.dumps(found), flush=True)
