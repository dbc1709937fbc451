"""An exercise on disk: which head, which tools, what to do, when it is passed.

A scenario is a TOML file for people; keys are checked strictly, so that a misspelt
one is refused instead of ignored. `docs/scenarios.md` describes every key.
"""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import Endoscope
from scenarios.exercise_check import file_problems, refuse
from scenarios.tasks.checks import nearest
from scenarios.tasks.task import Point, Task
from system import UserError
from system.typed_record import decode_toml

EXAMPLES = Path(__file__).parent.parent / "examples"
INSTALLED_EXAMPLES = Path(__file__).parent / "examples"
"""A wheel carries the examples inside this package."""

CURRICULUM = Path(__file__).parent / "curriculum"


class Nostril(StrEnum):
    """Name the side on which a scope enters."""

    RIGHT = "right"
    LEFT = "left"


class Level(StrEnum):
    """For whom an exercise is."""

    NOVICE = "novice"
    INTERMEDIATE = "intermediate"
    ADVANCED = "advanced"


class Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choose the patient: a phantom by its seed, a case, or an abstract scene.

    scene: name of a scene to practise in, one of `anatomy.abstract.SCENES`; the seed
    varies its layout.
    case: folder beside the scenario file, made by ``paravol import`` or ``paravol
    phantom``; seed and spacing are its own then. Loaded, it is a full path.
    decongested: its mucosa was shrunk before, see `surgery.decongestion`.
    variants: of a phantom's anatomy, names of `anatomy.phantom.variants`.
    polyps_right, polyps_left: grades 0 to 4 of a phantom's polyps.
    disease: of a phantom, words of `anatomy.phantom.variants`.
    patients: seeds of drawn patients, for one attempt after the other; none: the
    average adult, whose cells alone the seed draws.
    """

    seed: int = 1
    spacing_mm: float = 0.5
    case: str = ""
    decongested: bool = False
    variants: tuple[str, ...] = ()
    polyps_right: Annotated[int, msgspec.Meta(ge=0, le=4)] = 0
    polyps_left: Annotated[int, msgspec.Meta(ge=0, le=4)] = 0
    scene: str = ""
    disease: tuple[str, ...] = ()
    patients: tuple[Annotated[int, msgspec.Meta(ge=0, lt=2**31)], ...] = ()

    @property
    def number(self) -> int:
        """Return the seed of the first patient, or of whatever else it is."""
        return self.patients[0] if self.patients else self.seed

    def of_attempt(self, attempt: int) -> "Head":
        """Return the head of a trainee's attempt, 1 for the first, for good."""
        if not self.patients:
            return self
        return self.of_patient(self.patients[(attempt - 1) % len(self.patients)])

    def of_patient(self, number: int) -> "Head":
        """Return the head of one patient in each attempt; as it is without any."""
        if self.case or self.scene:
            return self
        return msgspec.structs.replace(self, patients=(number,))

    def words(self) -> str:
        """Return whose head it is, in a few words."""
        if self.case:
            return f"case {Path(self.case).name}"
        if self.scene:
            return f"scene {self.scene} {self.seed}"
        return f"{'patient' if self.patients else 'phantom'} {self.number}"


ANGLES_DEG = (0.0, 30.0, 45.0, 70.0)
"""Angles of the scopes that lie ready in every exercise that names none."""


class CameraHold(StrEnum):
    """Who keeps the camera head upright: nothing turns it, or the light post."""

    UPRIGHT = "upright"
    WITH_POST = "with the light post"


class Scope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choose the endoscope.

    angle_deg: of the one that is in hand at first. angles_deg: of those that may be
    put in beside it; none: `ANGLES_DEG`. camera: what turns the camera head beside the
    hand. camera_roll_deg: how far from upright it is at first.
    """

    diameter_mm: float = 2.7
    angle_deg: float = 0.0
    field_of_view_deg: float = 80.0
    ring_radius_mm: float = 0.95
    camera: CameraHold = CameraHold.UPRIGHT
    camera_roll_deg: float = 0.0
    angles_deg: tuple[float, ...] = ()

    @property
    def choices_deg(self) -> tuple[float, ...]:
        """Return the angles of all scopes that may be used, from the least on."""
        return tuple(sorted({self.angle_deg, *(self.angles_deg or ANGLES_DEG)}))

    def endoscope(self) -> Endoscope:
        """Build the scope; UserError names a figure out of range."""
        return Endoscope(
            diameter_mm=self.diameter_mm,
            angle_deg=self.angle_deg,
            field_of_view_deg=self.field_of_view_deg,
            ring_radius_mm=self.ring_radius_mm,
        )


class Start(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a scope enters that no recorded path leads.

    nostril: which one. tip_mm, axis: another place that holds its shaft, and the
    direction inwards, patient LPS; both or neither.
    """

    nostril: Nostril = Nostril.RIGHT
    tip_mm: Point | None = None
    axis: Point | None = None


class MetricLimit(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bound a metric for passing.

    name: as `paravol metrics` prints it, such as ``path length`` or ``hazard dose:
    orbit``. role: ``scope`` or ``tool``; "" for whichever has it. least, most: bounds,
    in the metric's unit.
    """

    name: str
    role: str = ""
    least: float | None = None
    most: float | None = None


class PassMarks(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """When an exercise is passed.

    tasks: names of those that must be done; none: all that are not optional.
    least_percent: of a rubric's points, where one is used.
    """

    tasks: tuple[str, ...] = ()
    metrics: tuple[MetricLimit, ...] = ()
    least_percent: Annotated[float, msgspec.Meta(ge=0, le=100)] = 0.0


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

    path: file name of the recorded probe path, beside the scenario file; "" where none
    is needed. start: where a scope enters without one.
    fiducials: touched with the stylus, in this order, to register the arm; a phantom
    without any has those of the mock head.
    targets: landmark names the tip should come near.
    tasks: what the trainee is asked to do. tools: that may be used; none: all.
    level, needs: for whom it is, and names of exercises to be passed before; see
    `scenarios.ladder`. hints: what helps, shown when it is asked for.
    """

    name: str
    title: str
    path: str = ""
    level: Level = Level.NOVICE
    about: str = ""
    needs: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()
    tools: tuple[str, ...] = ()
    start: Start = Start()
    marks: PassMarks = msgspec.field(default=PassMarks(), name="pass")
    head: Head = Head()
    scope: Scope = Scope()
    fiducials: tuple[Fiducial, ...] = ()
    targets: tuple[str, ...] = ()
    moments: tuple[Moment, ...] = ()
    tasks: tuple[Task, ...] = ()

    def fiducial_positions(self) -> dict[str, NDArray[np.float64]]:
        """Return the fiducials' positions ``(3,)`` by name, in order."""
        return {f.name: np.array(f.position_mm) for f in self.fiducials}


MOCK_HEAD = (
    Fiducial("nasion", (1.0, -14.0, 50.0)),
    Fiducial("right cheek", (-40.0, -2.0, 18.0)),
    Fiducial("left cheek", (43.0, -4.0, 24.0)),
    Fiducial("upper lip", (2.0, -16.0, -24.0)),
)
"""Divots of the mock head. No two distances are alike, so that a wrong order shows."""


def load_scenario(name: str) -> tuple[Scenario, Path]:
    """Read a scenario by bundled name or by path to its TOML file.

    Returns it with the folder its path file lies in. Raises UserError, in one
    sentence, for an unknown name or a file that does not say what it must.
    """
    file = Path(name)
    if file.suffix != ".toml":
        there = bundled_scenarios()
        if name not in there:
            raise UserError(
                f"There is no scenario named {name!r}{nearest(name, there)}; known "
                f"are: {', '.join(sorted(there)) or 'none'}. "
                "A scenario file of your own is given by its path, ending in .toml."
            )
        file = there[name]
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(
            f"The scenario file {file} cannot be read: {error.strerror}."
        ) from error
    scenario = decode_toml(content, Scenario, file, "a scenario")
    if not scenario.fiducials and not scenario.head.case:
        scenario = msgspec.structs.replace(scenario, fiducials=MOCK_HEAD)
    if len(scenario.fiducials) < 4:
        raise UserError(
            f"The scenario {scenario.name!r} names {len(scenario.fiducials)} "
            "fiducials; registration needs at least 4, so that an error in one shows."
        )
    if scenario.path and Path(scenario.path).name != scenario.path:
        raise UserError(
            f"The scenario {scenario.name!r} must name a path file beside it, "
            f"got {scenario.path!r}."
        )
    for angle_deg in scenario.scope.choices_deg:
        scenario.scope.endoscope().at(angle_deg)
    refuse(file, content, file_problems(scenario, bundled_scenarios()))
    if scenario.head.case:
        case = (file.parent / scenario.head.case).resolve()
        head = msgspec.structs.replace(scenario.head, case=str(case))
        scenario = msgspec.structs.replace(scenario, head=head)
    return scenario, file.parent


def bundled_scenarios() -> dict[str, Path]:
    """Return the files of the bundled exercises by name, the curriculum's first."""
    files = sorted(CURRICULUM.glob("*.toml"))
    for folder in (EXAMPLES, INSTALLED_EXAMPLES):
        if examples := sorted(folder.glob("*.toml")):
            files += examples
            break
    return {file.stem: file for file in files}
