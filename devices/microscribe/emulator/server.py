"""The loop that joins an emulated arm to a port."""

import os
import select
import socket
import sys
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Self

from devices.microscribe.emulator.actions import ActionSchedule, parse_action
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.socket_port import ServerPort
from devices.port import Closing

# How often an idle emulator looks whether its parent still lives.
IDLE_S = 0.5

_CONTROL_BYTES = 4096


class EmulatorServer(Closing):
    """Serve one arm at one port, here (``run``) or in a thread (``with``).

    ``announce`` is called with the port's name whenever it appears. ::

        arm = EmulatedArm(DX40937, orbit(DX40937), now_s=time.monotonic())
        with EmulatorServer(arm, TerminalPort()) as server:
            client = serial.Serial(server.port_name, 115200)
    """

    def __init__(
        self,
        arm: EmulatedArm,
        port: ServerPort,
        *,
        actions: ActionSchedule | None = None,
        announce: Callable[[str], None] | None = None,
        idle: Callable[[], None] | None = None,
    ) -> None:
        self.arm = arm
        self.failure: Exception | None = None
        """What ended the thread, if something did."""
        self._port = port
        self._actions = actions or ActionSchedule(())
        self._announce = announce
        self._idle = idle
        self._plugged = True
        self._generation = arm.generation
        self._stopped = False
        # sockets: pipes cannot be waited for everywhere
        self._woken, self._wake = socket.socketpair()
        self._commands: SimpleQueue[bytes] = SimpleQueue()
        self._thread = threading.Thread(target=self._run_in_thread, name="emulator")

    @property
    def port_name(self) -> str:
        """Return what a client opens."""
        return self._port.name

    def stop(self) -> None:
        """End ``run``, from any thread or signal handler."""
        self._stopped = True
        self._wake.send(b"x")

    def run(
        self, commands: int | None = None, *, dies_with_parent: bool = False
    ) -> None:
        """Serve until stopped or until a fault unplugs the arm for good.

        ``commands`` is a descriptor with an action's name on every line; its end, or
        the parent's if so wished, ends the service, too.
        """
        # Before the port is told: the parent may die of what it hears.
        parent = os.getppid() if dies_with_parent else None
        if self._announce is not None:
            self._announce(self._port.name)
        if commands is not None:
            reader = (commands,)
            threading.Thread(target=self._listen, args=reader, daemon=True).start()
        while not self._stopped and not self.arm.lost_for_good:
            watched = [self._woken.fileno(), *self._port.sources()]
            wait_s = self._wait_s(time.monotonic())
            if wait_s >= IDLE_S and self._idle is not None:
                self._idle()
            ready, _, _ = select.select(watched, [], [], min(wait_s, IDLE_S))
            if parent is not None and os.getppid() != parent:
                break
            if self._woken.fileno() in ready and not self._obey():
                break
            self._serve(any(source in ready for source in self._port.sources()))

    def close(self) -> None:
        """End the thread and take the port away; harmless when repeated."""
        if self._thread.is_alive():
            self.stop()
            self._thread.join()
        self._port.close()
        self._woken.close()
        self._wake.close()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def _run_in_thread(self) -> None:
        try:
            self.run()
        except Exception as error:
            self.failure = error
            self._port.pull()

    def _wait_s(self, now_s: float) -> float:
        due = self.arm.next_s()
        until_due = float("inf") if due is None else max(0.0, due - now_s)
        return min(until_due, self._actions.wait_s(self.arm, now_s))

    def _serve(self, readable: bool) -> None:
        arm, port = self.arm, self._port
        now = time.monotonic()
        rate = port.client_rate() if self._plugged else None
        if readable:
            arm.hear(port.read(), now, rate)
        self._actions.perform(arm, now)
        said = arm.speak(now, rate)
        if said and self._plugged:
            port.write(said)
        self._follow_plug()

    def _follow_plug(self) -> None:
        arm = self.arm
        if arm.plugged and self._plugged and arm.generation != self._generation:
            # out and in again between two looks
            self._move_plug(False)
        if arm.plugged != self._plugged:
            self._move_plug(arm.plugged)
        self._generation = arm.generation

    def _move_plug(self, plugged: bool) -> None:
        self._plugged = plugged
        if not plugged:
            self._port.pull()
            return
        self._port.plug()
        if self._announce is not None:
            self._announce(self._port.name)

    def _listen(self, commands: int) -> None:
        """Pass on what is written, and then its end."""
        written = b"x"
        while written:
            try:
                written = os.read(commands, _CONTROL_BYTES)
            except OSError:
                written = b""
            self._commands.put(written)
            try:
                self._wake.send(b"x")
            except OSError:
                return  # the service ended before

    def _obey(self) -> bool:
        """Perform the actions that were written; return whether more may come."""
        self._woken.recv(1)
        # one at a time: between an unplugging and the next the port has to follow
        return self._commands.empty() or self._perform(self._commands.get())

    def _perform(self, written: bytes) -> bool:
        """Perform actions; return whether there were any, as at the end are none."""
        for line in written.decode(errors="replace").split("\n"):
            if line.strip():
                try:
                    parse_action(line).start(self.arm, time.monotonic())
                except ValueError as error:
                    print(error, file=sys.stderr, flush=True)
        return bool(written)
