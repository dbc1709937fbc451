"""What is said over the endoscope's picture, and for how long."""

import time
from collections import deque

from app.window.panels.endoscope_panel import PictureView

NOTICE_S = 4.0

LONG_S = 2.0
"""A stage that takes longer is told with its seconds: a bar may stand."""


class Notices:
    """What the page says, one thing at a time.

    A question stays until it is answered, a stage until the next is said; notices wait
    meanwhile.
    """

    def __init__(self, picture: PictureView) -> None:
        self._picture = picture
        self._until_s = 0.0
        self._waiting: deque[tuple[str, str]] = deque()
        self._stage: tuple[str, str, float] | None = None
        self._staged_s = 0.0
        self.is_asking = False

    def say(self, message: str, detail: str = "", share: float | None = None) -> None:
        """Say something until the next is said; `share` makes it a stage with a bar."""
        if self.is_asking:
            return
        before, self._stage = self._stage, None
        self._until_s = 0.0
        if share is None:
            self._picture.say(message, detail)
            return
        if before is None or before[0] != message:
            self._staged_s = time.monotonic()
        self._stage = message, detail, share
        self._show_stage()

    def notify(self, message: str, detail: str) -> None:
        """Say something for a while, or later where it would hide what must be seen."""
        if self.is_asking or self._stage is not None:
            if (message, detail) not in self._waiting:
                self._waiting.append((message, detail))
            return
        self.say(message, detail)
        self._until_s = time.monotonic() + NOTICE_S

    def ask(self, question: str, answers: str) -> None:
        """Put a question."""
        self.say(question, answers)
        self.is_asking = True

    def answered(self) -> None:
        """Take the question away."""
        self.is_asking = False
        self.say("")

    def refresh(self) -> None:
        """Take away what was said long enough; say what waited for its end."""
        if self.is_asking:
            return
        if self._stage is not None:
            self._show_stage()
        elif self._until_s and time.monotonic() >= self._until_s:
            self.say("")
        if not self._until_s and not self._picture.message and self._waiting:
            self.notify(*self._waiting.popleft())

    def _show_stage(self) -> None:
        assert self._stage is not None
        message, detail, share = self._stage
        lasts_s = time.monotonic() - self._staged_s
        told = f"{message} · {lasts_s:.0f} s" if lasts_s >= LONG_S else message
        self._picture.say(told, detail, share)
