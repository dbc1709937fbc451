"""What is said over the endoscope's picture, and for how long."""

import time

from app.window.panels.endoscope_panel import PictureView

NOTICE_S = 4.0


class Notices:
    """Say one thing at a time; a question stays until it is answered."""

    def __init__(self, picture: PictureView) -> None:
        self._picture = picture
        self._until_s = 0.0
        self.is_asking = False

    def say(self, message: str, detail: str = "", share: float | None = None) -> None:
        """Say something until the next is said; `share` draws a bar under it."""
        if not self.is_asking:
            self._picture.say(message, detail, share)
            self._until_s = 0.0

    def notify(self, message: str, detail: str) -> None:
        """Say something for a while."""
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
        """Take away what was said long enough."""
        if self._until_s and time.monotonic() >= self._until_s:
            self.say("")
            self._until_s = 0.0
