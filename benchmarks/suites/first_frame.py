"""A process that draws one endoscope frame of a small hollow and ends.

Run as a child: its life is the time from an empty process to the first picture.
"""

import numpy as np

from paravol.environment import prepare_environment

CAVITY_MM = 9.0
SIZE = 128


def draw_first_frame() -> int:
    """Draw a hollow ball from its middle; give the sum of the picture's bytes."""
    prepare_environment()
    # After the environment is set: these import numba.
    from renderers.fsr import FuzzySetRenderer
    from renderers.scene import AirSurface, Camera, Scene, TransferFunction, Volume
    from renderers.shading import CameraPass, ScopeLight, ScopeShader, scope_picture

    axis = np.arange(-12.0, 13.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = (np.sqrt(x**2 + y**2 + z**2) - CAVITY_MM).astype(np.float32)
    grid = Volume(distance, np.ones(3), np.full(3, -12.0), background=6.0)
    surface = AirSurface(
        grid,
        grid.with_values(np.full(grid.shape, 54, np.uint8), 0.0),
        grid.with_values(np.zeros(grid.shape, np.uint8), 0.0),
    )
    transfer = TransferFunction(
        np.array([-1.0, 1.0]), np.full((2, 3), 0.5), np.array([0.0, 4.0])
    )
    camera = Camera.looking_at((0, 0, 0), (0, -5, 1), size=(SIZE, SIZE))
    renderer = FuzzySetRenderer(Scene(grid, transfer, surface=surface), threads=1)
    shader, camera_pass = ScopeShader(surface, threads=1), CameraPass(threads=1)
    gbuffer = renderer.gbuffer(camera)
    picture, _ = scope_picture(gbuffer, camera, shader, camera_pass, ScopeLight())
    for part in (renderer, shader, camera_pass):
        part.close()
    return int(picture.sum())


if __name__ == "__main__":
    raise SystemExit(0 if draw_first_frame() > 0 else 1)
