"""`paravol volume`: a scan in a window, as a volume or a surface."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.page_window import run_page
from app.cli.root import Threads, thread_count
from app.cli.terminal import ProgressReporter
from system import UserError

if TYPE_CHECKING:
    from app.window.main_window import MainWindow
    from app.window.volume.volume_page import VolumePage


def volume(
    case: Path | None = None, *, look: Path | None = None, threads: Threads = 0
) -> int:
    """Show a scan whole in a window: as a volume whose look is edited, or a surface.

    Parameters
    ----------
    case
        A case folder, as import and phantom write; the bundled head when left out.
    look
        A file that the window saved: transfer function, threshold and lights.
    """
    from paravol.patient import load_case, load_patient
    from paravol.volume.look import load_look
    from paravol.volume.scan import scans_of
    from scenarios import load_scenario

    if look is not None and not look.is_file():
        raise UserError(f"There is no file {look}.")
    chosen = None if look is None else load_look(look)
    with ProgressReporter() as stages:
        if case is None:
            patient = load_patient(load_scenario("first_flight")[0], stages)
        else:
            patient = load_case(case, stages)
        scans = scans_of(patient.scene.volume, patient.others)

    def make(
        window: "MainWindow", edge_samples: int
    ) -> "tuple[VolumePage, Callable[[], object]]":
        from app.window.volume.volume_page import VolumePage

        title = "The bundled head" if case is None else case.resolve().name
        page = VolumePage(title, scans, thread_count(threads))
        if chosen is not None:
            page.controls.show_look(chosen)
        return page, lambda: None

    return run_page(make)
