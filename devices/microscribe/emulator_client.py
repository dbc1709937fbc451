"""An emulated MicroScribe in a process of its own, held by this one."""

import json
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from devices.port import DeviceError, DeviceReason

READY_S = 30.0
STOP_S = 5.0


class MicroScribeEmulator:
    """Start an emulated arm; ``port_name`` is where a driver finds it.

    The child ends when this object stops it, when this process ends however it ends,
    or when a fault unplugs the arm. ``fiducials_mm`` is (n, 3), patient LPS; the arm
    touches them in order before it follows the path.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        fiducials_mm: NDArray[np.float64] | None = None,
        profile: str = "dx40937",
        seed: int = 0,
        faults: Sequence[str] = (),
        fast: bool = False,
    ) -> None:
        if sys.platform == "win32":
            raise DeviceError(
                DeviceReason.NO_PORT,
                "The emulated arm needs pseudo-terminals, which Windows lacks; attach "
                "a real one.",
            )
        command = [sys.executable, "-m", "devices.microscribe.emulator"]
        command += ["--watch-stdin", f"--path={path}", f"--profile={profile}"]
        command += [f"--seed={seed}", *(f"--fault={fault}" for fault in faults)]
        command += ["--fast"] if fast else []
        if fiducials_mm is not None and len(fiducials_mm):
            points = np.asarray(fiducials_mm, dtype=np.float64).tolist()
            command += [f"--fiducial={','.join(map(repr, p))}" for p in points]
        self._child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # Ctrl-C belongs to the program that holds the emulator, which stops it.
            start_new_session=True,
        )
        try:
            ready = self._wait_until_ready()
        except BaseException:
            self.stop()
            raise
        self.port_name: str = ready["port"]
        self.device_from_world: NDArray[np.float64] = np.array(
            ready["device_from_world"]
        )
        """The truth a registration should find, (4, 4); a real arm does not know it."""

    @property
    def running(self) -> bool:
        """Get whether the child lives."""
        return self._child.poll() is None

    def stop(self) -> None:
        """End the child and wait for it; harmless when repeated."""
        for pipe in (self._child.stdin, self._child.stdout, self._child.stderr):
            if pipe is not None:
                pipe.close()
        self._child.terminate()
        try:
            self._child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _wait_until_ready(self) -> dict[str, Any]:
        stdout, stderr = self._child.stdout, self._child.stderr
        assert stdout is not None
        assert stderr is not None
        readable, _, _ = select.select([stdout], [], [], READY_S)
        line = stdout.readline() if readable else b""
        if not line:
            self._child.kill()
            said = stderr.read().decode(errors="replace").strip().splitlines()
            raise DeviceError(
                DeviceReason.NO_DEVICE,
                f"The emulated arm did not start: {said[-1] if said else 'no reason'}",
            )
        ready: dict[str, Any] = json.loads(line)
        return ready
