"""Our scenes in words a peer understands, each with the peer's best settings."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_process import PeerProcess
from renderers.fsr import FuzzySet
from renderers.fsr.kernels.footprint import SIGMA_PER_SPACING
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.scene import Camera, Projection, Scene, TransferFunction
from system import UserError

NEAR_MM = 0.2
"""Nothing is nearer to the eyes of the benchmarks' views."""

NODES_PER_HU = 1.0
"""VTK interpolates opacity between nodes, we extinction; with a node at every unit
of density the two agree."""

NEAREST_SPLAT_SIGMAS = 2.0
"""A footprint wider than half its distance has no linear projection: our splatter
leaves it out, and the peer is not given it."""


def view_job(camera: Camera, scene: Scene, budget_s: float) -> dict[str, Any]:
    """Describe a square pinhole; UserError for any other lens."""
    if camera.projection is not Projection.PERSPECTIVE or camera.width != camera.height:
        raise UserError("VTK is compared with in square perspective pictures only")
    volume = scene.volume
    half = np.array(volume.shape[::-1]) * volume.spacing_mm / 2
    reach = float(np.linalg.norm(camera.eye_mm - volume.center_mm))
    return {
        "frame": camera.frame.tolist(),
        "extent": camera.extent,
        "size": camera.width,
        "near_mm": NEAR_MM,
        "far_mm": reach + float(np.linalg.norm(half)),
        "budget_s": budget_s,
    }


class VolumeJobs:
    """Write a scene's volume and tables once; make a job for each picture."""

    def __init__(self, peer: PeerProcess, scene: Scene) -> None:
        volume = scene.volume
        if not np.array_equal(volume.direction, np.eye(3)):
            raise UserError("the peer is given volumes along the world's axes only")
        self._scene = scene
        self._values = peer.store(volume.values)
        self._table = peer.store(dense_table(scene.transfer_function))

    def job(
        self, camera: Camera, step_voxels: float, *, shaded: bool, budget_s: float
    ) -> dict[str, Any]:
        """Ask for one view at one step."""
        scene, volume = self._scene, self._scene.volume
        ahead = float((volume.center_mm - camera.eye_mm) @ camera.frame[3])
        return view_job(camera, scene, budget_s) | {
            "centre_behind": ahead < 1.0,
            "values": self._values,
            "table": self._table,
            "spacing_mm": volume.spacing_mm.tolist(),
            "origin_mm": volume.origin_mm.tolist(),
            "step_mm": step_voxels * float(volume.spacing_mm.min()),
            "shaded": shaded,
            "ambient": scene.material.ambient,
            "diffuse": scene.material.diffuse,
            "lights": [[li.vector.tolist(), li.color.tolist()] for li in scene.lights],
        }


def dense_table(transfer: TransferFunction) -> NDArray[np.float64]:
    """Return rows (density, r, g, b, extinction), the user's own nodes among them."""
    low, high = transfer.nodes[0], transfer.nodes[-1]
    even = np.linspace(low, high, int((high - low) * NODES_PER_HU) + 1)
    nodes = np.unique(np.concatenate([even, transfer.nodes]))
    color, kappa = transfer.evaluate(nodes)
    return np.column_stack([nodes, color, kappa])


def splat_job(
    peer: PeerProcess,
    scene: Scene,
    fuzzy_set: FuzzySet,
    camera: Camera,
    budget_s: float,
) -> dict[str, Any]:
    """Hand over exactly our splats: places, lit colours, peaks, width.

    Raises UserError for voxels that are not cubic: these peers have round splats.
    """
    spacing = scene.volume.spacing_mm
    if not np.allclose(spacing, spacing[0]):
        raise UserError(f"the splat peer needs cubic voxels, got {spacing}")
    positions = fuzzy_set.rows.centers_mm()
    sigma_mm = SIGMA_PER_SPACING * float(spacing[0])
    distance = np.linalg.norm(positions - camera.eye_mm, axis=1)
    drawn = distance > NEAREST_SPLAT_SIGMAS * sigma_mm
    rgba = ShadedSet(fuzzy_set, scene).straight_rgba()[drawn]
    return view_job(camera, scene, budget_s) | {
        "points": peer.store(positions[drawn].astype(np.float32)),
        "rgba": peer.store(np.rint(np.clip(rgba, 0, 1) * 255).astype(np.uint8)),
        "sigma_mm": sigma_mm,
    }
