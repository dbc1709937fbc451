"""`paravol debrief`: write the page, say where it is."""

from dataclasses import asdict
from pathlib import Path

from app.cli.terminal import Stages, print_json
from disk import demand_place
from paravol.debrief import DebriefOrder, write_debrief


def run_debrief(order: DebriefOrder, *, as_json: bool) -> int:
    """Write a session's debrief."""
    demand_place(order.out)
    with Stages() as stages:
        written = write_debrief(order, stages, stages.say)
    if as_json:
        print_json({**asdict(written), "out": str(written.out)})
    else:
        print(
            f"{written.out}: {written.events} events, {written.pictures} pictures, "
            f"{written.size_bytes / 1e6:.1f} MB in one file; open it in any browser."
        )
    return 0


def beside(session: Path) -> Path:
    """Return where a session's debrief goes when no place is named."""
    return session.with_name(f"{session.name.removesuffix('.paravol')}-debrief.html")
