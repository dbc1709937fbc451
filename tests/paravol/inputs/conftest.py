import numpy as np
import pytest

from anatomy import PhantomParameters, classic_transfer_function
from anatomy.queries.landmarks import landmarks
from devices import ProbePath, load_probe_path
from paravol.patient import PatientScene
from renderers.scene import AirSurface, Scene, Volume
from scenarios import Scenario, load_scenario


@pytest.fixture
def bare_room() -> PatientScene:
    """The landmarks of the head without the head: all is air."""
    air = Volume(np.zeros((4, 4, 4), np.float32), np.ones(3), np.zeros(3))
    far_air = Volume(np.full((4, 4, 4), -9e2, np.float32), np.ones(3), np.zeros(3))
    pale = Volume(np.zeros((4, 4, 4), np.uint8), np.ones(3), np.zeros(3))
    places = landmarks(PhantomParameters())
    return PatientScene(
        Scene(
            air, classic_transfer_function(), surface=AirSurface(far_air, pale, pale)
        ),
        {name: landmark.position_mm for name, landmark in places.items()},
        "0123",
    )


@pytest.fixture
def exercise() -> tuple[Scenario, ProbePath]:
    scenario, folder = load_scenario("first_flight")
    return scenario, load_probe_path(folder / scenario.path)
