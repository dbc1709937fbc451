"""Pictures of moments of a session: as they were live, or by the ray tracer."""

import base64
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paravol.debrief.events import Event
from paravol.debrief.findings import Findings
from paravol.patient import Progress
from paravol.sessions.session_setup import build_view
from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.render_session import render_session
from paravol.snapshots.view_file import ScopeLook
from paravol.snapshots.view_sources import session_views
from renderers.scene.lens_state import CLEAN
from scenarios.instrument_state import NO_TOOL

JPEG_QUALITY = 85
STAGE = "Drawing the pictures"


class Quality(StrEnum):
    """What draws: the live renderer, or the ray tracer."""

    FAST = "fast"
    FINE = "fine"


MOST_PICTURES = 16
PICTURE_SIZE = 320


@dataclass(frozen=True, slots=True)
class DebriefOrder:
    """What is wanted.

    folder: the session. out: the HTML file. compare: another session of the same head;
    None for the scenario's own path. quality: who draws; None draws nothing. pictures,
    size: how many events get one, and its width and height in pixels. case: where the
    case that was flown through lies now. rubric: name or file; "" for the one that
    comes with the program for what was done.
    """

    folder: Path
    out: Path
    compare: Path | None = None
    quality: Quality | None = Quality.FAST
    pictures: int = MOST_PICTURES
    size: int = PICTURE_SIZE
    threads: int = 1
    case: Path | None = None
    rubric: str = ""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as the page has it; url: ``data:`` with the whole JPEG."""

    url: str
    width: int
    height: int

    @classmethod
    def of(cls, pixels: NDArray[np.uint8]) -> "Picture":
        """Compress sRGB pixels ``(h, w, 3)``."""
        sink = io.BytesIO()
        Image.fromarray(pixels).save(
            sink, "JPEG", quality=JPEG_QUALITY, subsampling=0, optimize=True
        )
        text = base64.b64encode(sink.getvalue()).decode("ascii")
        height, width = pixels.shape[:2]
        return cls(f"data:image/jpeg;base64,{text}", width, height)


@dataclass(frozen=True, slots=True)
class Wounds:
    """One view without tools, before anybody operated and at the end.

    shown_s: the moment whose view it is.
    """

    before: Picture
    after: Picture
    shown_s: float


@dataclass(frozen=True, slots=True)
class Pictures:
    """The pictures of events by their numbers; wounds: None where none was cut."""

    of_events: dict[int, Picture]
    wounds: Wounds | None
    quality: Quality | None


NO_PICTURES = Pictures({}, None, None)


def draw_pictures(
    order: DebriefOrder,
    findings: Findings,
    events: Sequence[Event],
    progress: Progress,
    say: Callable[[str], None],
) -> Pictures:
    """Draw what was seen at events, and the wound before and after.

    The findings' timeline is elsewhere afterwards.
    """
    edits = findings.metrics.measured.edits
    wound_s = edits[-1].time_s if edits else None
    if order.quality is Quality.FAST:
        return _live(order, findings, events, wound_s, progress)
    return _traced(order, findings, events, wound_s, progress, say)


def _live(
    order: DebriefOrder,
    findings: Findings,
    events: Sequence[Event],
    wound_s: float | None,
    progress: Progress,
) -> Pictures:
    """Draw with the live renderer, the tissue as it was at each moment."""
    info = findings.recording.info
    timeline = findings.timeline
    timeline.resize((order.size, order.size))
    # what it did on its way to the end is in the tissue that is drawn first
    timeline.go_to(max(findings.end_s, 0.0))
    drawn = build_view(
        findings.scenario,
        timeline.patient,
        tier=info.tier,
        seed=info.seed,
        has_instrument=info.has_instrument or info.operated,
        threads=order.threads,
    )

    def picture(time_s: float, bare_at_s: float | None = None) -> Picture:
        sample, changes = timeline.go_to(max(time_s, 0.0))
        drawn.apply(changes)
        operation = timeline.session.operation
        drawn.lens = CLEAN
        if bare_at_s is None:
            seen, at_s = timeline.session.view(sample), time_s
            if operation is not None and operation.lens is not None:
                drawn.lens = operation.lens.state
        else:
            seen, at_s = replace(wound_view, instrument=NO_TOOL), bare_at_s
        frame = timeline.frame(at_s)
        shown = drawn.draw(
            seen,
            number=0 if frame is None else frame.number,
            elapsed_s=0.0,
            gain=None if frame is None else frame.gain,
        )
        return Picture.of(shown.pixels)

    found: dict[int, Picture] = {}
    wounds = before = None
    count = len(events) + (0 if wound_s is None else 2)
    if wound_s is not None:
        sample, changes = timeline.go_to(wound_s)
        drawn.apply(changes)
        wound_view = timeline.session.view(sample)
        before = picture(findings.begin_s, wound_s)
    for event in sorted(events, key=lambda e: e.shown_s):
        progress(STAGE, len(found) / count)
        found[event.number] = picture(event.shown_s)
    if wound_s is not None and before is not None:
        wounds = Wounds(before, picture(findings.end_s, wound_s), wound_s)
    progress(STAGE, 1.0)
    return Pictures(found, wounds, Quality.FAST)


def _traced(
    order: DebriefOrder,
    findings: Findings,
    events: Sequence[Event],
    wound_s: float | None,
    progress: Progress,
    say: Callable[[str], None],
) -> Pictures:
    """Have the ray tracer draw, the tissue as it was at each moment."""
    times = [max(event.shown_s, 0.0) for event in events]
    if wound_s is not None:
        times += [wound_s, findings.end_s]
    if not times:
        return NO_PICTURES
    head, views = session_views(
        order.folder, np.array(times), order.size, order.case, progress
    )
    if wound_s is not None:
        bare = msgspec.structs.replace(views[-2], instruments=())
        assert isinstance(bare.look, ScopeLook)
        bare = msgspec.structs.replace(bare, look=bare.look.through(CLEAN))
        views[-2] = msgspec.structs.replace(bare, operated=None)
        views[-1] = msgspec.structs.replace(bare, operated=views[-1].operated)
    drawn: list[Picture] = []
    with render_session(head, progress, say) as session:
        for n, view in enumerate(views):
            stage = f"{STAGE} ({n + 1} of {len(views)})"
            rendered, _ = session.draw(view, RenderSettings(), stage)
            drawn.append(Picture.of(rendered.pixels))
    wounds = None
    if wound_s is not None:
        wounds = Wounds(drawn[-2], drawn[-1], wound_s)
    numbers = [event.number for event in events]
    of_events = dict(zip(numbers, drawn, strict=False))
    return Pictures(of_events, wounds, Quality.FINE)
