"""The thread that owns an arm while others read its poses."""

import threading
import time

from devices.microscribe.driver.sampler import HomeState
from devices.microscribe.driver.supervisor import ConnectionSupervisor
from devices.port import DeviceError, DeviceReason
from devices.pose_queue import PoseQueue

# Up to here a sleep is cut short by nobody: waiting for an event costs more.
SHORT_PAUSE_S = 0.05

# Between two looks whether an arm that is to be homed is still there to be.
HOMING_LOOK_S = 0.1

# While nobody waits for the very next pose a stream is read in batches: a wake-up finds
# cold caches, which doubles the cost of a pose, and a frame loop looks less often.
BATCH_S = 0.012


class ArmThread:
    """Run a supervisor step by step and queue its poses until told to stop."""

    def __init__(self, supervisor: ConnectionSupervisor) -> None:
        name = f"the arm on {supervisor.port.name}"
        self.queue = PoseQueue(name, self._refuse_unhomed, self._silence)
        self._supervisor = supervisor
        self._at_last_pose = supervisor.counters
        """What the line had done when it fell silent."""
        self._stop = threading.Event()
        self._homing: threading.Event | None = None
        self._thread = threading.Thread(target=self._run, name="microscribe")
        # A forgotten arm must not keep the interpreter; atexit still ends its session.
        self._thread.daemon = True
        self._thread.start()

    def home(self) -> None:
        """Home the arm and wait until it was done; raise if it cannot be."""
        homing = self._homing = threading.Event()
        while not (homing.wait(HOMING_LOOK_S) or self.queue.is_over):
            pass
        self.queue.refuse()

    def stop(self) -> None:
        """End the session and the thread; harmless when repeated."""
        self._stop.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _refuse_unhomed(self) -> None:
        if self._supervisor.sampler.home_state is HomeState.UNKNOWN:
            raise DeviceError(
                DeviceReason.NOT_HOMED,
                f"The arm on {self._supervisor.port.name} may stand elsewhere than it "
                "believes; put it into its rest and home it (`paravol home`).",
            )

    def _silence(self, timeout_s: float) -> str:
        """Return why no pose came in that time, and what to do."""
        supervisor, before = self._supervisor, self._at_last_pose
        began = (
            f"No pose came from the arm on {supervisor.port.name} in {timeout_s:g} s"
        )
        if supervisor.trouble is not None:
            return f"{began}; it is being looked for. {supervisor.trouble}"
        since = {name: n - before[name] for name, n in supervisor.counters.items()}
        damaged = sum(since[name] for name in ("framing", "noise", "suspect", "stray"))
        if since["refused"]:
            return (
                f"{began}: its joints seem to leap in each of {since['refused']} "
                "packets; check the cable."
            )
        if since["packets"]:
            return f"{began} in spite of {since['packets']} packets; check the cable."
        if damaged:
            return (
                f"{began}: {damaged} bytes came that are no packets; check the cable "
                "and the adapter."
            )
        return f"{began}: it does not answer; check its power and the cable."

    def _run(self) -> None:
        supervisor, queue = self._supervisor, self.queue
        losses = 0
        heard = False
        failure: Exception | None = None
        try:
            while not self._stop.is_set():
                if self._homing is not None and supervisor.home():
                    self._homing.set()
                    self._homing = None
                poses = supervisor.step(0.0 if queue.is_awaited else BATCH_S)
                if poses:
                    queue.put(poses)
                elif heard:
                    self._at_last_pose = supervisor.counters
                heard = bool(poses)
                if supervisor.losses > losses and supervisor.trouble is not None:
                    losses = supervisor.losses
                    queue.tell(supervisor.trouble)
                self._pause(supervisor.due_s - time.monotonic())
        except Exception as error:
            # Nobody sees what a thread raises; the reader of the poses must.
            failure = error
        # What made the session fail is the better story than the echo of it.
        echo = self._release()
        failure = failure or echo
        if failure is None:
            queue.end()
        else:
            queue.fail(failure)

    def _pause(self, seconds: float) -> None:
        if seconds > SHORT_PAUSE_S:
            self._stop.wait(seconds)
        elif seconds > 0.0:
            time.sleep(seconds)

    def _release(self) -> DeviceError | None:
        """Close the arm; return what went wrong, unless it had gone away."""
        try:
            self._supervisor.close()
        except DeviceError as error:
            if error.reason is not DeviceReason.DISCONNECTED:
                return error
        return None
