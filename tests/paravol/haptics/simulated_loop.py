"""The force loop in simulated time: a head, a tool of one ball, a floor of bone."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from devices.haptics.mock_head import HeadFault, HeadModel, MockHead
from paravol.haptics.force_loop import PERIOD_S, loop_arguments, new_feeling
from paravol.haptics.kernels.run_loop import tick_at
from paravol.haptics.tissue_copies import TissueCopies
from surgery.patient import OperatedPatient
from tests.surgery.heads import PAPYRACEA, floor_at, walled

START_NS = 10**9
PERIOD_NS = round(PERIOD_S * 1e9)
FLOOR_MM = 8.0
RADIUS_MM = 1.0
AT = (12.0, 11.0)

HARD = replace(PAPYRACEA, fracture_n=0.0)
"""A wall that nothing breaks."""


def place(height_mm: float) -> NDArray[np.float64]:
    """Give an upright pose at a height above the floor, in the patient."""
    pose = np.eye(4)
    pose[:3, 3] = (*AT, FLOOR_MM + RADIUS_MM + height_mm)
    return pose


def ball() -> NDArray[np.float64]:
    return np.array([[0.0, 0.0, 0.0, RADIUS_MM]])


def floor() -> OperatedPatient:
    surface = floor_at(FLOOR_MM)
    return OperatedPatient(surface, walled(surface, HARD))


@dataclass
class SimulatedLoop:
    """Tick the compiled loop's ticks at moments of our own."""

    patient: OperatedPatient = field(default_factory=floor)
    model: HeadModel = field(default_factory=HeadModel)
    fault: HeadFault = field(default_factory=HeadFault)
    world_from_device: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        self.head = MockHead(self.model, self.fault)
        self.copies = TissueCopies(self.patient)
        feeling = new_feeling(self.patient.layers, ball(), self.head.limits, PERIOD_S)
        self.arguments = loop_arguments(
            self.head, self.copies.tissue, feeling, PERIOD_S
        )
        self.loop = self.arguments.loop
        self.loop["is_placed"] = 1
        self.loop["world_from_device"][0] = self.world_from_device[:3]
        self.now_ns = START_NS
        self.forces: list[NDArray[np.float64]] = []
        self.heights: list[float] = []
        self.faults: list[int] = []

    def lead(self, height_mm: float, lasts_s: float) -> None:
        """Send the hand to a height above the floor."""
        goal = np.linalg.inv(self.world_from_device) @ place(height_mm)
        self.head.lead(goal, lasts_s)

    def tick(self, count: int = 1, period_ns: int = PERIOD_NS) -> None:
        for _ in range(count):
            tick_at(*self.arguments, self.now_ns)
            self.forces.append(self.loop["force_n"][0].copy())
            tip = np.append(self.head.state["position_mm"][0], 1.0)
            height = (self.world_from_device @ tip)[2] - FLOOR_MM - RADIUS_MM
            self.heights.append(height)
            self.faults.append(int(self.loop["fault"][0]))
            self.now_ns += period_ns

    @property
    def sizes(self) -> NDArray[np.float64]:
        sizes: NDArray[np.float64] = np.linalg.norm(np.array(self.forces), axis=1)
        return sizes
