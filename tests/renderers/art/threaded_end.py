"""A loop-back whose ranks run in threads of their own."""

import threading

from renderers.art.messages import Message
from renderers.art.transport import LoopBackEnd


class ThreadedEnd(LoopBackEnd):
    """Let ranks of one loop-back run in threads of their own."""

    lock = threading.Lock()

    def send(self, message: Message) -> None:
        with self.lock:
            super().send(message)

    def poll(self) -> Message | None:
        with self.lock:
            return super().poll()

    def rest(self, waiting: bool) -> None:
        threading.Event().wait(1e-4)
