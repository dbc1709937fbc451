"""Transfer functions for CT numbers."""

import numpy as np

from renderers.scene.transfer import TransferFunction


def classic_transfer_function() -> TransferFunction:
    """Return the preset for mode `classic`: red mucosa, ivory bone, clear air.

    The ramp into mucosa is centred on -480 HU, half way from air: there alone its
    place does not depend on the scanner's blur. All its colours are one: a surface is
    made of voxels from all over the ramp, and others would draw bands on it.
    """
    nodes = [-1000.0, -600.0, -300.0, 100.0, 250.0, 700.0, 1500.0]
    color = [
        (0.53, 0.18, 0.16),
        (0.53, 0.18, 0.16),
        (0.53, 0.18, 0.16),
        (0.53, 0.18, 0.16),
        (0.75, 0.55, 0.42),
        (0.85, 0.78, 0.62),
        (0.90, 0.87, 0.80),
    ]
    kappa = [0.0, 0.0, 4.0, 4.0, 6.0, 20.0, 40.0]
    return TransferFunction(np.array(nodes), np.array(color), np.array(kappa))


def bone_transfer_function() -> TransferFunction:
    """Return the preset that shows bone through faint soft tissue.

    Thin walls reach 100-400 HU at clinical resolution, so its ramp starts there. Bone
    has one colour, see `classic_transfer_function`.
    """
    nodes = np.array([-1000.0, 60.0, 140.0, 500.0, 1500.0])
    color = np.tile((0.87, 0.81, 0.70), (len(nodes), 1))
    return TransferFunction(nodes, color, np.array([0.0, 0.0, 1.0, 8.0, 30.0]))
