"""The head on the table, ready to be drawn: phantom, scene, landmarks."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy import PhantomParameters, classic_transfer_function, sinus_phantom
from renderers.scene import AirSurface, Scene
from scenarios import Scenario

Progress = Callable[[str, float], None]
"""Called with what is being done and the done share, 0 to 1."""


@dataclass(frozen=True, slots=True)
class OperatingRoom:
    """Hold what every picture of a session shares.

    landmarks: world positions ``(3,)`` in mm by name; paired ones carry their side,
        as in ``"maxillary ostium right"``.
    surface_sha256: hash of the air distance values and where they lie.
    """

    scene: Scene
    landmarks: dict[str, NDArray[np.float64]]
    surface_sha256: str

    @property
    def surface(self) -> AirSurface:
        """Get the surface that the endoscope sees."""
        assert self.scene.surface is not None
        return self.scene.surface

    def positions(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Look landmarks up; ValueError names an unknown one and those there are."""
        unknown = [name for name in names if name not in self.landmarks]
        if unknown:
            raise ValueError(
                f"The head has no landmark {unknown[0]!r}; it has: "
                f"{', '.join(sorted(self.landmarks))}."
            )
        return {name: self.landmarks[name] for name in names}


def prepare_room(scenario: Scenario, progress: Progress) -> OperatingRoom:
    """Build the scenario's head, or fetch it from the cache."""
    head = scenario.head
    phantom = sinus_phantom(
        PhantomParameters(seed=head.seed),
        spacing_mm=head.spacing_mm,
        progress=lambda stage, share: progress(f"Head: {stage}", share),
    )
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    landmarks = {
        name: np.asarray(landmark.position_mm)
        for name, landmark in phantom.landmarks.items()
    }
    return OperatingRoom(scene, landmarks, surface_hash(surface))


def surface_hash(surface: AirSurface) -> str:
    """Hash the distance values, their grid, the tint: all that a picture depends on."""
    digest = hashlib.sha256()
    for volume in (surface.distance, surface.blood, surface.skin):
        digest.update(repr(volume.shape).encode())
        digest.update(volume.world_from_voxel.tobytes())
        digest.update(volume.values.tobytes())
    return digest.hexdigest()
