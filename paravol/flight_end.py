"""What a trainee is told when a flight is over."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from paravol.kept_sessions import KEPT_BYTES
from paravol.told_score import score_rows
from scenarios import Score


@dataclass(frozen=True, slots=True)
class FlightEnd:
    """Hold a flight's result.

    title: how it ended. record: folder of its recording, None where there is none, and
    `problem` says why. automatic: nobody named the folder.
    """

    title: str
    score: Score
    record: Path | None = None
    automatic: bool = False
    problem: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Give the figures' names and texts, in order."""
        return score_rows(self.score)

    def where(self) -> str:
        """Say where the recording is, in one line."""
        if self.record is None:
            return f"Not recorded: {self.problem or 'nobody asked for it'}"
        return f"Recorded in {self.record}"

    def lines(self) -> list[str]:
        """Say what can be done with the recording, for a terminal."""
        told = [self.where()]
        if self.record is not None:
            told.append(f"Fly it again: paravol replay {shlex.quote(str(self.record))}")
        if self.record is not None and self.automatic:
            told.append(
                f"The newest {KEPT_BYTES / 1e9:g} GB of such flights are kept; "
                "--record NAME.paravol keeps one for good."
            )
        return told
