"""The options of `paravol replay`, with their help."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from app.cli.root import Flag, Threads
from system import UserError


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class ReplayOptions:
    """Options of a replay, as they were typed.

    Parameters
    ----------
    check
        End with status 1 unless every frame and every figure comes out the same.
    video
        Write the frames as an MP4 film.
    speed
        With --video: seconds of the session in one of the film, .1 to 10.
    from_s
        With --video: begin the film at this second of the session.
    to_s
        With --video: end the film at this second of the session.
    beside
        With --video or --picture: another session, shown beside this one. It is run
        faster or slower, so that both reach the same landmarks together.
    camera
        With --video or --picture: a view file whose camera looks on in place of the
        scope's, as --view-at writes it.
    at
        Stop at this second and tell the score, what was taken and bled, and the
        injuries so far; nothing is compared.
    picture
        With --at: write the live picture of then as a PNG.
    view_at
        Write what was seen at this second as a view file, for `paravol snapshot
        --view`; without --check or --video nothing else is done.
    out
        The view file, such as a.view.json.
    case
        With --at, --view-at, --window or a film of one's own: where the case that was
        flown through lies now.
    window
        Open the trainee's window and replay it there, with --beside two at a time.
    """

    window: Flag = False
    check: bool = False
    video: Path | None = None
    speed: float | None = None
    from_s: Annotated[float | None, Parameter(name="--from")] = None
    to_s: Annotated[float | None, Parameter(name="--to")] = None
    beside: Path | None = None
    camera: Path | None = None
    at: float | None = None
    picture: Path | None = None
    view_at: float | None = None
    out: Path | None = None
    case: Path | None = None
    threads: Threads = 0

    @property
    def is_own_film(self) -> bool:
        """Return whether the film is more than the recorded frames at their times."""
        asked = (self.speed, self.from_s, self.to_s, self.beside, self.camera)
        return self.video is not None and any(word is not None for word in asked)

    def require_sense(self) -> None:
        """UserError for options that do not go together."""
        if (self.view_at is None) != (self.out is None):
            raise UserError("--view-at and --out go together.")
        if self.window:
            self._require_window()
        is_timed = (
            self.window
            or self.at is not None
            or self.out is not None
            or self.is_own_film
        )
        if self.case is not None and not is_timed:
            raise UserError(
                "--case goes with --at, --view-at or a film with --speed, --from, "
                "--to, --beside or --camera."
            )
        if self.picture is not None and self.at is None:
            raise UserError("--picture goes with --at, the second that it shows.")
        if self.at is not None and (
            self.check or self.video is not None or self.out is not None
        ):
            raise UserError("--at goes without --check, --video and --view-at.")
        for name, value in (("--beside", self.beside), ("--camera", self.camera)):
            is_drawn = self.video is not None or self.picture is not None
            if value is not None and not (is_drawn or self.window):
                raise UserError(
                    f"{name} goes with --video, or with --at and --picture."
                )
        for name, word in (
            ("--speed", self.speed),
            ("--from", self.from_s),
            ("--to", self.to_s),
        ):
            if word is not None and self.video is None:
                raise UserError(f"{name} goes with --video, the film.")
        if self.speed is not None:
            from paravol.sessions.player import require_speed

            require_speed(self.speed)
        if self.check and self.is_own_film:
            raise UserError(
                "--check compares the recorded frames; leave --speed, --from, --to, "
                "--beside and --camera out."
            )

    def _require_window(self) -> None:
        """UserError for what the window has buttons for, or no use of."""
        others = {
            "--check": self.check or None,
            "--video": self.video,
            "--at": self.at,
            "--view-at": self.view_at,
            "--camera": self.camera,
        }
        for name, value in others.items():
            if value is not None:
                raise UserError(f"--window goes without {name}.")


REPLAYED = ReplayOptions()
