"""What a rank said and heard last, for the day when something is wrong."""

import time
from collections import deque
from pathlib import Path

from renderers.art.ranks.messages import Message
from system import whole_file

LENGTH = 4096
"""Messages kept, both ways together."""


class FlightRecorder:
    """Remember the last messages of a rank; write them to a file when asked."""

    def __init__(self, folder: Path, rank: int, length: int = LENGTH) -> None:
        self._folder = folder
        self._rank = rank
        self._entries: deque[tuple[float, str, Message]] = deque(maxlen=length)

    def note(self, way: str, message: Message) -> None:
        """Remember a message. way: `to` or `from` another rank."""
        if message.payload:
            # Cells are large; that one went is what matters.
            message = message._replace(payload=b"")
        self._entries.append((time.monotonic(), way, message))

    def write(self, reason: str) -> str:
        """Write ``flight-rank-<n>.txt``; tell where it is, or why there is none."""
        now = time.monotonic()
        lines = [f"rank {self._rank}: {reason}"]
        for when, way, m in self._entries:
            other = m.target if way == "to" else m.source
            lines.append(
                f"{when - now:10.4f} s {way:4} {other:5} {m.kind.name:18} "
                f"cell {m.cell} frame {m.frame} generation {m.generation} "
                f"who {m.who} aux {m.aux}"
            )
        path = self._folder / f"flight-rank-{self._rank}.txt"
        try:
            with whole_file(path) as beside:
                beside.write_text("\n".join(lines) + "\n", encoding="utf-8")
        except OSError as error:
            return f"What it heard could not be written: {error.strerror}."
        return f"What it heard last is in {path}."
