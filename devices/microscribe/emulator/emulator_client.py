"""An emulated MicroScribe in a process of its own, held by this one."""

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, NoReturn, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.emulator.actions import parse_action
from devices.port import BytePort, Closing, DeviceError, DeviceReason
from system import group_options

READY_S = 30.0
STOP_S = 5.0


class EmulatorChoice(TypedDict, total=False):
    """What may be told of an emulated arm; the rest is as `EmulatorSettings` has it."""

    fiducials_mm: NDArray[np.float64]
    profile: str
    seed: int
    faults: Sequence[str]
    actions: Sequence[str]
    link: Path
    fast: bool


class MicroScribeEmulator(Closing):
    """Start an emulated arm; ``port_name`` is where a driver finds it.

    The child ends when this object closes it, when this process ends however it ends,
    or when a fault unplugs the arm. ``fiducials_mm`` is (n, 3), patient LPS; the arm
    touches them in order before it follows the path. ``link`` is a symbolic link to the
    port, kept right when the arm is plugged in elsewhere.
    """

    def __init__(self, path: Path | str, **chosen: Unpack[EmulatorChoice]) -> None:
        asked = json.dumps({"path": path, **chosen}, default=_plain)
        process = "devices.microscribe.emulator.process"
        self._child = subprocess.Popen(
            [sys.executable, "-m", process, asked],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # Ctrl-C belongs to the program that holds the emulator, which stops it.
            **group_options(),
        )
        self._said: SimpleQueue[bytes] = SimpleQueue()
        self._listener = threading.Thread(target=self._listen, name="emulator")
        self._listener.start()
        try:
            ready = self._announcement(READY_S) or self._complain()
        except BaseException:
            self.close()
            raise
        self.port_name: str = ready["port"]
        self.device_from_world: NDArray[np.float64] = np.array(
            ready["device_from_world"]
        )
        """The truth a registration should find, (4, 4); a real arm does not know it."""

    @property
    def running(self) -> bool:
        """Return whether the child lives."""
        return self._child.poll() is None

    def do(self, action: str) -> None:
        """Have something done to the arm now, such as ``unplug`` or ``left_pedal``.

        Raises UserError for an unknown action.
        """
        parse_action(action)
        assert self._child.stdin is not None
        self._child.stdin.write(f"{action}\n".encode())
        self._child.stdin.flush()

    def names(self) -> list[str]:
        """Return the port's newest name, for a driver that looks for its arm.

        Raises DeviceError when the arm was unplugged for good.
        """
        while (ready := self._announcement(0.0)) is not None:
            self.port_name = ready["port"]
        if not self.running:
            raise DeviceError(
                DeviceReason.DISCONNECTED, "The emulated arm was unplugged for good."
            )
        return [self.port_name]

    def open(self, name: str) -> BytePort:
        """Open the port of that name; raise DeviceError if that cannot be."""
        return SerialPort(name)

    def close(self) -> None:
        """End the child and wait for it; harmless when repeated."""
        assert self._child.stdin is not None
        self._child.stdin.close()
        self._child.terminate()
        try:
            self._child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        # only now has the listener come to the end of what it reads
        self._listener.join()
        for pipe in (self._child.stdout, self._child.stderr):
            if pipe is not None:
                pipe.close()

    def _announcement(self, timeout_s: float) -> dict[str, Any] | None:
        try:
            line = self._said.get(timeout=timeout_s)
        except Empty:
            return None
        if not line:
            return None
        ready: dict[str, Any] = json.loads(line)
        return ready

    def _listen(self) -> None:
        """Keep what the child says; pipes cannot be waited for everywhere."""
        stdout = self._child.stdout
        assert stdout is not None
        for line in stdout:
            self._said.put(line)
        self._said.put(b"")

    def _complain(self) -> NoReturn:
        stderr = self._child.stderr
        assert stderr is not None
        self._child.kill()
        said = stderr.read().decode(errors="replace").strip().splitlines()
        raise DeviceError(
            DeviceReason.NO_DEVICE,
            f"The emulated arm did not start: {said[-1] if said else 'no reason'}",
        )


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else str(value)
