"""Pictures of a recorded session at any moment, beside another, and films of them.

The tissue, the tool and the lens are those of the moment. The camera is the scope's, or
one of one's own: it then shows the same patient from where it stands, through a clean
lens, with the light that it carries.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paravol.feedback import NO_SIGNS, TouchSigns
from paravol.feedback.felt_signs import felt_signs
from paravol.patient import PatientScene, Progress, load_patient, thread_count
from paravol.sessions.free_camera import FreeCamera, shaft_in_scene
from paravol.sessions.keyframes import load_keyframes
from paravol.sessions.player import Player
from paravol.sessions.session_alignment import TimeMap, align, session_marks
from paravol.sessions.session_setup import build_view, flown_scenario
from paravol.sessions.session_timeline import SessionTimeline
from paravol.sessions.video import VideoWriter
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.snapshot_queue import SelectedMoment
from paravol.snapshots.view_file import ViewCamera
from paravol.view import EndoscopeView, Frame
from renderers.scene.lens_state import CLEAN
from renderers.shading import LOOK_VERSION
from scenarios import FrameState, Sample
from scenarios.bundle import FrameRecord, read_recording
from scenarios.tasks import TaskState

FILM_FPS = 30.0

SETTLED_S = 10.0
"""After so long a camera's exposure follows no longer."""

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


@dataclass(frozen=True, slots=True)
class ShownMoment:
    """A recorded session's moment, drawn.

    sample: the newest of then. view: what it meant in the patient, with the camera that
    looked on. recorded: the frame whose gain it has, None where none was recorded.
    is_recorded: whether the picture is the one that was seen in flight, to the bit;
    None where none was shown of this very sample, or with another look, size or camera.
    tissue_changed: since the moment that was shown before. tasks, signs: of then.
    """

    sample: Sample
    view: FrameState
    frame: Frame
    recorded: FrameRecord | None
    is_recorded: bool | None
    tissue_changed: bool
    tasks: tuple[TaskState, ...] = ()
    signs: TouchSigns = NO_SIGNS


class SessionPictures:
    """Draw a recorded session as it was at any time.

    timeline: what is gone through; its patient's landmarks are the flown head's.
    scenario: that was flown. pristine: the patient before anybody operated.
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

        camera: in place of the scope's. size: ``(width, height)`` of all pictures; None
        as recorded, where one frame may be larger than the next. case: where the case
        lies now. patient: taken where it is the one that was flown through, as it was
        before anybody operated.
        """
        recording = read_recording(folder)
        self.scenario = flown_scenario(folder, recording.info, case)
        sha256 = recording.info.surface_sha256
        if patient is None or patient.surface_sha256 != sha256:
            patient = load_patient(self.scenario, progress)
        self.patient = patient
        keyframes = load_keyframes(folder, patient)
        self.timeline = SessionTimeline(
            folder, patient, recording, size=size, keyframes=keyframes
        )
        self._given = size
        self.size = size or recording.info.picture_size
        self._camera = None if camera is None else camera.camera(self.size)
        self._progress = progress
        self._threads = threads or thread_count()
        self._view: EndoscopeView | None = None
        self._shown: ShownMoment | None = None
        self._shown_by: FreeCamera | None = None

    def at(self, time_s: float) -> NDArray[np.uint8]:
        """Return the picture of a time, ``(h, w, 3)`` sRGB, all of one size.

        Errors as the timeline.
        """
        return self.moment(time_s, size=self.size).frame.pixels

    def moment(
        self,
        time_s: float,
        free: FreeCamera | None = None,
        report: Callable[[float], None] = lambda _: None,
        size: tuple[int, int] | None = None,
    ) -> ShownMoment:
        """Return the moment of a time, drawn; errors as the timeline.

        free: looks on in place of the scope, whose shaft then stands in the scene.
        report: as `SessionTimeline.go_to` has it. size: of the picture; None for the
        given one, or that of the recorded frame.
        """
        timeline = self.timeline
        sample, changes = timeline.go_to(time_s, report)
        before = self._shown
        is_shown = before is not None and before.sample is sample
        if before is not None and is_shown and self._shown_by is free and not changes:
            return replace(before, tissue_changed=False)
        if self._view is None:
            # built of the tissue as it is now
            self._view = self._build()
        else:
            self._view.apply(changes)
        operation = timeline.session.operation
        recorded = timeline.frame(time_s)
        gain = None if recorded is None else recorded.gain
        size = size or self._given
        if size is None and recorded is not None:
            size = recorded.size_of(self.size)
        flown = seen = timeline.session.view(sample, size)
        self._view.lens, self._view.props = CLEAN, ()
        if free is not None:
            seen = replace(seen, camera=free.camera(seen.camera))
            scope = timeline.session.endoscope
            shaft = shaft_in_scene(scope, seen.world_from_tip, free.frame[0])
            self._view.props = tuple(shaft)
        elif self._camera is not None:
            seen = replace(seen, camera=self._camera)
        elif operation is not None and operation.lens is not None:
            self._view.lens = operation.lens.state
        is_own = seen is not flown
        elapsed_s = 0.0 if before is None else 1.0 / FILM_FPS
        if free is not None:
            # one who looks around and rests sees what a camera shows in the end
            elapsed_s = SETTLED_S
        frame = self._view.draw(
            seen,
            number=0 if recorded is None else recorded.number,
            elapsed_s=elapsed_s,
            gain=None if is_own else gain,
        )
        tasks, signs = timeline.session.tasks, TouchSigns(hazard=seen.hazard)
        if operation is not None:
            signs = felt_signs(operation, seen.hazard, 0)
        self._shown_by = free
        self._shown = ShownMoment(
            sample,
            seen,
            frame,
            recorded,
            None if is_own else self._is_recorded(sample, recorded, frame),
            bool(changes),
            () if tasks is None else tasks.states,
            signs,
        )
        return self._shown

    def _is_recorded(
        self, sample: Sample, recorded: FrameRecord | None, frame: Frame
    ) -> bool | None:
        """Return whether a picture is the recorded one; None where there is none."""
        info, places = self.timeline.recording.info, self.timeline.recording.places
        if recorded is None or not recorded.xxh3_128 or info.look != LOOK_VERSION:
            return None
        if frame.pixels.shape[1::-1] != recorded.size_of(info.picture_size):
            return None
        if places.get(recorded.sample) != self.timeline.place:
            return None
        return frame.fingerprint() == recorded.xxh3_128

    def selected(self, name: str = "") -> SelectedMoment | None:
        """Return the moment that was shown last, to be drawn at high quality.

        To be called by the thread that shows moments. None before the first. name: see
        `SelectedMoment`.
        """
        if self._shown is None:
            return None
        # a way to elsewhere may have ended before its picture
        shown = self.moment(self._shown.sample.time_s, self._shown_by)
        operation = self.timeline.session.operation
        tissue = None
        if operation is not None:
            tissue = OperatedHead.of(operation.patient, operation.pushing)
        return SelectedMoment(
            shown.sample.time_s,
            shown.view,
            shown.frame.gain,
            0 if shown.recorded is None else shown.recorded.number,
            tissue,
            shown.frame.lens,
            props=self._view.props if self._view is not None else (),
            name=name,
        )

    def _build(self) -> EndoscopeView:
        info = self.timeline.recording.info
        return build_view(
            self.scenario,
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
