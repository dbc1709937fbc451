"""Pictures of a recorded session at any moment, beside another, and films of them.

The tissue, the tool and the lens are those of the moment. The camera is the scope's, or
one of one's own: it then shows the same patient from where it stands, through a clean
lens, with the light that it carries.
"""

from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paravol.patient import PatientScene, Progress, load_patient, thread_count
from paravol.player import Player
from paravol.session_alignment import TimeMap, align, session_marks
from paravol.session_setup import build_view, flown_scenario
from paravol.session_timeline import SessionTimeline
from paravol.snapshots.view_file import ViewCamera
from paravol.video import VideoWriter
from paravol.view import EndoscopeView
from renderers.scene.lens_state import CLEAN
from scenarios.bundle import read_recording

FILM_FPS = 30.0

GAP_PX = 8
"""Between two pictures side by side."""


class Pictures(Protocol):
    """Something of which there is a picture at any time.

    size: ``(width, height)``.
    """

    size: tuple[int, int]

    def at(self, time_s: float) -> NDArray[np.uint8]:
        """Return the picture of a session's time, ``(h, w, 3)`` sRGB."""
        ...


class SessionPictures:
    """Draw a recorded session as it was at any time.

    timeline: what is gone through; its patient's landmarks are the flown head's.
    """

    def __init__(
        self,
        folder: Path,
        *,
        progress: Progress,
        camera: ViewCamera | None = None,
        size: tuple[int, int] | None = None,
        case: Path | None = None,
        threads: int | None = None,
        patient: PatientScene | None = None,
    ) -> None:
        """Load what was flown through; errors as `SessionTimeline` has them.

        camera: in place of the scope's. size: ``(width, height)``, None as recorded.
        case: where the case lies now. patient: taken where it is the one that was
        flown through, as it was before anybody operated.
        """
        recording = read_recording(folder)
        self._scenario = flown_scenario(folder, recording.info, case)
        sha256 = recording.info.surface_sha256
        if patient is None or patient.surface_sha256 != sha256:
            patient = load_patient(self._scenario, progress)
        self.patient = patient
        self.timeline = SessionTimeline(folder, patient, recording, size=size)
        self.size = size or recording.info.picture_size
        self._camera = None if camera is None else camera.camera(self.size)
        self._progress = progress
        self._threads = threads or thread_count()
        self._view: EndoscopeView | None = None
        self._shown: tuple[float, NDArray[np.uint8]] | None = None

    def at(self, time_s: float) -> NDArray[np.uint8]:
        """Return the picture of a time, ``(h, w, 3)`` sRGB; errors as the timeline."""
        timeline = self.timeline
        sample, changes = timeline.go_to(time_s)
        if self._shown is not None and self._shown[0] == sample.time_s:
            return self._shown[1]
        if self._view is None:
            # built of the tissue as it is now
            self._view = self._build()
        else:
            self._view.apply(changes)
        operation = timeline.session.operation
        self._view.lens = CLEAN
        if operation is not None and operation.lens is not None and not self._camera:
            self._view.lens = operation.lens.state
        seen = timeline.session.view(sample)
        recorded = timeline.frame(time_s)
        gain = None if recorded is None else recorded.gain
        if self._camera is not None:
            seen, gain = replace(seen, camera=self._camera), None
        frame = self._view.draw(
            seen,
            number=0 if recorded is None else recorded.number,
            elapsed_s=0.0 if self._shown is None else 1.0 / FILM_FPS,
            gain=gain,
        )
        self._shown = sample.time_s, frame.pixels
        return frame.pixels

    def _build(self) -> EndoscopeView:
        info = self.timeline.recording.info
        return build_view(
            self._scenario,
            self.timeline.patient,
            tier=info.tier,
            seed=info.seed,
            has_instrument=info.has_instrument or info.operated,
            threads=self._threads,
            progress=self._progress,
            visible_sets=info.visible_sets,
        )


class SideBySide:
    """Draw a session with another beside it, at the moment that belongs to it.

    times: from the first session to the second.
    """

    def __init__(self, here: SessionPictures, there: SessionPictures) -> None:
        """Align both; they must draw pictures of one size."""
        self._here, self._there = here, there
        self.times: TimeMap = align(
            session_marks(here.timeline.recording, here.patient.landmarks),
            session_marks(there.timeline.recording, there.patient.landmarks),
            (here.timeline.begin_s, here.timeline.end_s),
            (there.timeline.begin_s, there.timeline.end_s),
        )
        width, height = here.size
        # a film needs even sides
        self.size = (2 * width + GAP_PX, height)

    def at(self, time_s: float) -> NDArray[np.uint8]:
        """Return both pictures, each with its own time; time_s: of the first one."""
        other_s = self.times.at(time_s)
        sheet = Image.new("RGB", self.size)
        width = self._here.size[0]
        left, right = self._here.at(time_s), self._there.at(other_s)
        sheet.paste(Image.fromarray(left), (0, 0))
        sheet.paste(Image.fromarray(right), (width + GAP_PX, 0))
        draw = ImageDraw.Draw(sheet)
        font = ImageFont.load_default(size=max(round(width / 24), 10))
        for x, shown_s in ((6, time_s), (width + GAP_PX + 6, other_s)):
            draw.text((x, 4), f"{shown_s:.1f} s", fill=(230, 230, 230), font=font)
        return np.asarray(sheet)


class FilmClock:
    """The time of a film: it passes only when a frame is added."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def now(self) -> float:
        """Return the film's time."""
        return self._now_s

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self._now_s += seconds


def film_session(
    file: Path,
    pictures: Pictures,
    times_s: tuple[float, float],
    *,
    speed: float,
    progress: Progress,
) -> float:
    """Write a film of a part of a session; return how long it lasts, s.

    times_s: of the session, from and to. speed: seconds of the session in one of the
    film. The film shows each moment when it is due, to within one of its frames.
    """
    clock = FilmClock()
    player = Player(times_s, clock, speed=speed)
    player.play()
    with VideoWriter(file, pictures.size, FILM_FPS) as film:
        while True:
            film.add(pictures.at(player.position_s))
            done_s = player.position_s - times_s[0]
            progress("Filming", done_s / (times_s[1] - times_s[0]))
            if player.is_over:
                return film.duration_s
            clock.sleep(player.next_frame_s(FILM_FPS))
