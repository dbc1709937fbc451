"""`paravol debrief`: what a recorded session is talked over with."""

from dataclasses import asdict
from pathlib import Path
from typing import Literal

from app.cli.root import Flag, Json, Threads, thread_count
from app.cli.terminal import ProgressReporter, print_json
from system import require_place


def debrief(
    session: Path,
    *,
    out: Path | None = None,
    compare: Path | None = None,
    quality: Literal["fast", "fine"] = "fast",
    no_pictures: Flag = False,
    pictures: int = 16,
    rubric: str = "",
    case: Path | None = None,
    threads: Threads = 0,
    json: Json = False,
) -> int:
    """Write what a recorded session is talked over with: one HTML file, offline.

    Timeline, hazards, path, wounds, tissue taken, metrics, comparison, and what to
    practise next. A minute of flight takes about a minute.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    out
        The HTML file; NAME-debrief.html beside the session when left out.
    compare
        Another session of the same head, such as an earlier one or an expert's. The
        path that comes with the scenario when left out.
    quality
        Who draws the pictures: the live renderer, or the ray tracer, which takes a few
        seconds for each.
    no_pictures
        Draw none: fewer seconds, and a file of some 200 kB.
    pictures
        Events that get a picture, at most.
    rubric
        Name of a rubric or a TOML file: points, pass mark, margins. The one for
        operating, or for endoscopy where nothing was cut, when left out.
    case
        Where the case that was flown through lies now.
    """
    from paravol.debrief import DebriefOrder, write_debrief
    from paravol.debrief.pictures import Quality

    name = session.name.removesuffix(".paravol")
    order = DebriefOrder(
        session,
        out or session.with_name(f"{name}-debrief.html"),
        compare=compare,
        quality=None if no_pictures else Quality(quality),
        pictures=pictures,
        threads=thread_count(threads),
        case=case,
        rubric=rubric,
    )
    require_place(order.out)
    with ProgressReporter() as stages:
        written = write_debrief(order, stages, stages.say)
    if json:
        print_json({**asdict(written), "out": str(written.out)})
    else:
        print(
            f"{written.out}: {written.events} events, {written.pictures} pictures, "
            f"{written.size_bytes / 1e6:.1f} MB in one file; open it in any browser."
        )
    return 0
