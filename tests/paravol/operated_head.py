"""A small head to be operated on, without the cost of a phantom."""

import numpy as np

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from paravol.patient import PatientScene
from scenarios import Scenario
from tests.scenes import make_scene


def head_round_an_orbit(scenario: Scenario) -> PatientScene:
    """Return a head with an orbit of 2 mm in its middle, where all targets lie."""
    scene = make_scene()
    centre = scene.volume.center_mm
    matrix = scene.volume.world_from_voxel
    voxels = np.indices(scene.volume.shape)[::-1].reshape(3, -1).T
    away = np.linalg.norm(voxels @ matrix[:3, :3].T + matrix[:3, 3] - centre, axis=1)
    orbit = np.rint((away - 2.0) / UNIT_MM).reshape(scene.volume.shape)
    hazards = HazardVolumes(
        {"orbit": scene.volume.with_values(orbit.astype(np.int16), 1000.0)}
    )
    landmarks = dict.fromkeys(scenario.targets, centre)
    return PatientScene(scene, landmarks, "a" * 64, hazards=hazards)
