"""An exercise on disk: which head, which tools, which path, which moments matter.

A scenario is a TOML file for people; keys are checked strictly, so that a misspelt
one is refused instead of ignored.
"""

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from disk import UserError
from disk.typed_record import decode_toml
from scenarios.endoscope import Endoscope
from scenarios.tasks.task import Task

EXAMPLES = Path(__file__).parent.parent / "examples"
INSTALLED_EXAMPLES = Path(__file__).parent / "examples"
"""A wheel carries the examples inside this package."""


class Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choose the patient: a phantom by its seed, a case, or an abstract scene.

    scene: name of a scene to practise in, one of `anatomy.abstract.SCENES`; the seed
    varies its layout.
    case: folder beside the scenario file, made by ``paravol import`` or ``paravol
    phantom``; seed and spacing are its own then. Loaded, it is a full path.
    decongested: its mucosa was shrunk before, see `surgery.decongestion`.
    """

    seed: int = 1
    spacing_mm: float = 0.5
    case: str = ""
    decongested: bool = False
    scene: str = ""


class Scope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choose the endoscope."""

    diameter_mm: float = 2.7
    angle_deg: float = 0.0
    field_of_view_deg: float = 80.0
    ring_radius_mm: float = 0.95

    def endoscope(self) -> Endoscope:
        """Build the scope; ValueError names a figure out of range."""
        return Endoscope(
            diameter_mm=self.diameter_mm,
            angle_deg=self.angle_deg,
            field_of_view_deg=self.field_of_view_deg,
            ring_radius_mm=self.ring_radius_mm,
        )


class Moment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Name a moment of the path that deserves a high-quality snapshot."""

    name: str
    time_s: float


class Fiducial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Place a divot of the mock head that is touched to register the arm.

    position_mm: patient LPS.
    """

    name: str
    position_mm: tuple[float, float, float]


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Describe one exercise.

    path: file name of the recorded probe path, beside the scenario file.
    fiducials: touched with the stylus, in this order, to register the arm.
    targets: landmark names the tip should come near.
    tasks: what the trainee is asked to do.
    """

    name: str
    title: str
    path: str
    head: Head = Head()
    scope: Scope = Scope()
    fiducials: tuple[Fiducial, ...] = ()
    targets: tuple[str, ...] = ()
    moments: tuple[Moment, ...] = ()
    tasks: tuple[Task, ...] = ()

    def fiducial_positions(self) -> dict[str, NDArray[np.float64]]:
        """Return the fiducials' positions ``(3,)`` by name, in order."""
        return {f.name: np.array(f.position_mm) for f in self.fiducials}


def load_scenario(name: str) -> tuple[Scenario, Path]:
    """Read a scenario by bundled name or by path to its TOML file.

    Returns it with the folder its path file lies in. Raises ValueError, in one
    sentence, for an unknown name or a file that does not say what it must.
    """
    file = Path(name)
    if file.suffix != ".toml":
        found = [f for f in _bundled() if f.stem == name]
        if not found:
            known = ", ".join(sorted(f.stem for f in _bundled())) or "none"
            raise UserError(
                f"There is no scenario named {name!r}; known are: {known}. "
                "A scenario file of your own is given by its path, ending in .toml."
            )
        file = found[0]
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(
            f"The scenario file {file} cannot be read: {error.strerror}."
        ) from error
    scenario = decode_toml(content, Scenario, file, "a scenario")
    if len(scenario.fiducials) < 4:
        raise UserError(
            f"The scenario {scenario.name!r} names {len(scenario.fiducials)} "
            "fiducials; registration needs at least 4, so that an error in one shows."
        )
    if Path(scenario.path).name != scenario.path:
        raise UserError(
            f"The scenario {scenario.name!r} must name a path file beside it, "
            f"got {scenario.path!r}."
        )
    scenario.scope.endoscope()
    if scenario.head.case:
        case = (file.parent / scenario.head.case).resolve()
        head = msgspec.structs.replace(scenario.head, case=str(case))
        scenario = msgspec.structs.replace(scenario, head=head)
    return scenario, file.parent


def _bundled() -> list[Path]:
    for folder in (EXAMPLES, INSTALLED_EXAMPLES):
        files = sorted(folder.glob("*.toml"))
        if files:
            return files
    return []
