"""Light from wall to wall by Mitsuba 3: its camera, rays, paths; a mesh for the walls.

Of ours it has the field whose zero set is the wall, the normals the wall is shaded by,
and the law of the scope's fibre ends, which none of its own emitters has.
"""

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, sobel
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

from benchmarks.peers.job_loop import Job, serve
from benchmarks.peers.peer_process import Answer
from benchmarks.timing import Timing

try:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
except ImportError as error:
    raise SystemExit(
        f"no Mitsuba here ({str(error).splitlines()[0]}); docs/light.md says how to "
        "install it"
    ) from error

Places = NDArray[np.float64]
NEAR_MM = 1e-3
"""Where its rays begin."""
SHORT_SHARE = 1e-4
"""By which a ray to a source ends before it."""

vtk_arrays: Any = numpy_support


class FibreEnd(mi.Emitter):
    """Shine from a point by the spot law ``each exp(-spread (1 - cos theta)) / d^2``.

    d^2 counts as `nearest_mm2` where it is less.
    """

    def __init__(self, properties: Any) -> None:
        super().__init__(properties)
        self._at = mi.ScalarPoint3f(properties["position"])
        self._forward = mi.ScalarVector3f(properties["forward"])
        self._each = properties["each"]
        self._spread = properties["spread"]
        self._nearest = properties["nearest_mm2"]
        self.m_flags = mi.EmitterFlags.DeltaPosition

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
        """Return the way to the one point there is, and the light along it."""
        way = dr.zeros(mi.DirectionSample3f)
        way.p, way.time, way.pdf, way.delta = mi.Point3f(self._at), it.time, 1.0, True
        way.emitter = mi.EmitterPtr(self)
        towards = way.p - it.p
        squared = dr.squared_norm(towards)
        way.dist = dr.sqrt(squared)
        way.d = towards / way.dist
        away = 1 + dr.dot(way.d, self._forward)
        light = self._each * dr.exp(-self._spread * away)
        light /= dr.maximum(squared, self._nearest)
        return way, mi.Color3f(light) & active

    def pdf_direction(self, it: Any, way: Any, active: Any = True) -> Any:
        """Return 0: no other ray meets a point."""
        return mi.Float(0)

    def eval(self, si: Any, active: Any = True) -> Any:
        """Return 0, as `pdf_direction`."""
        return mi.Color3f(0)

    def bbox(self) -> Any:
        """Return the point."""
        return mi.ScalarBoundingBox3f(self._at)


mi.register_emitter("fibre_end", FibreEnd)


class LightPeer:
    """Follow the light of one scene after the other, on one thread."""

    def __init__(self) -> None:
        dr.set_thread_count(1)
        self._walls: dict[tuple[str, int], tuple[Places, Places, Places]] = {}

    def work(self, job: Job, folder: Path) -> Answer:
        """Walk a job's passes; see `light_jobs`.

        The picture is ``(passes, h, w, 3)`` irradiance; the times are of all passes.
        """
        scene = self._scene(job)
        warm = self._pass(scene, job, 2**31 - 1)
        passes = np.empty((job["passes"], *warm.shape), np.float32)
        cpu, wall = time.process_time(), time.perf_counter()
        for number in range(job["passes"]):
            passes[number] = self._pass(scene, job, job["seed"] + number)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        path = folder / "passes.npy"
        np.save(path, passes, allow_pickle=False)
        return Answer(timing=Timing.of([wall], [cpu]), picture=str(path))

    def _pass(self, scene: Any, job: Job, seed: int) -> NDArray[np.float32]:
        """Walk so many paths a pixel, all through the pixels' centres."""
        size, paths, bounces = job["size"], job["paths"], job["bounces"]
        count = size * size * paths
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, count)
        pixel = dr.arange(mi.UInt32, count) // paths
        centre = mi.Point2f(
            (mi.Float(pixel % size) + 0.5) / size,
            (mi.Float(pixel // size) + 0.5) / size,
        )
        ray, _ = scene.sensors()[0].sample_ray(0.0, 0.0, centre, mi.Point2f(0.5))
        seen = True
        # what it counts are the ends of rays: the eye's, the walls', the light's
        depth = bounces + 2
        if job["bounced_only"]:
            first = scene.ray_intersect(ray)
            if job["lifted_mm"] is not None:
                found = _lifted_paths(scene, sampler, first, job)
                return _mean_of(found, size, paths)
            seen, depth = first.is_valid(), bounces + 1
            along = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
            ray = first.spawn_ray(first.to_world(along))
        paths_of = mi.load_dict({"type": "path", "max_depth": depth})
        radiance, _, _ = paths_of.sample(scene, sampler, ray, active=seen)
        irradiance = math.pi * _mean_of(dr.select(seen, radiance, 0), size, paths)
        if not job["bounced_only"]:
            irradiance /= np.array(job["albedo"], np.float32)
        return irradiance

    def _scene(self, job: Job) -> Any:
        key = job["values"], job["refined"]
        if key not in self._walls:
            self._walls = {key: wall_mesh(job)}
        points, normals, faces = self._walls[key]
        eye, _, up, forward = np.array(job["frame"])
        properties = mi.Properties()
        properties["bsdf"] = mi.load_dict(
            {
                "type": "diffuse",
                "reflectance": {"type": "rgb", "value": list(job["albedo"])},
            }
        )
        mesh = mi.Mesh(
            "walls", len(points), len(faces), has_vertex_normals=True, props=properties
        )
        arrays = mi.traverse(mesh)
        # from the eye, as ours: float32 loses least where one looks
        arrays["vertex_positions"] = (points - eye).astype(np.float32).ravel()
        arrays["vertex_normals"] = normals.astype(np.float32).ravel()
        arrays["faces"] = faces.astype(np.uint32).ravel()
        arrays.update()
        scene = {"type": "scene", "walls": mesh}
        for number, source in enumerate(job["sources"]):
            scene[f"end {number}"] = {
                "type": "fibre_end",
                "position": source,
                "forward": forward.tolist(),
                "each": job["power"] / len(job["sources"]),
                "spread": job["spread"],
                "nearest_mm2": job["nearest_mm2"],
            }
        scene["eye"] = {
            "type": "perspective",
            "fov": math.degrees(2 * job["extent"]),
            "near_clip": NEAR_MM,
            "far_clip": 1e3,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=[0, 0, 0], target=forward.tolist(), up=up.tolist()
            ),
            "film": {"type": "hdrfilm", "width": job["size"], "height": job["size"]},
        }
        return mi.load_dict(scene)


def _lifted_paths(scene: Any, sampler: Any, first: Any, job: Job) -> Any:
    """Return the irradiance that each path brings to the wall where it begins.

    As Mitsuba's own integrator, but for two things. A path leaves its wall a little
    above it, along the normal that it is shaded by: where it then heads below the
    triangle it meets the wall at once and goes on, as ours does. Mitsuba's ends
    there. And no path is ended by chance.
    """
    lifted, sources = job["lifted_mm"], scene.emitters()
    at, normal, alive = first.p, first.sh_frame.n, first.is_valid()
    carried, brought = mi.Color3f(1), mi.Color3f(0)
    for _ in range(job["bounces"]):
        along = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        ray = mi.Ray3f(at + lifted * normal, mi.Frame3f(normal).to_world(along))
        met = scene.ray_intersect(ray, alive)
        alive &= met.is_valid() & (dr.dot(met.n, ray.d) < 0)
        at, normal = met.p, met.sh_frame.n
        carried *= mi.Color3f(job["albedo"])
        lit = mi.Color3f(0)
        for source in sources:
            way, light = source.sample_direction(met, mi.Point2f(0), alive)
            facing = dr.dot(normal, way.d)
            shadow = mi.Ray3f(at + lifted * normal, way.d)
            shadow.maxt = way.dist * (1 - SHORT_SHARE)
            open_ = alive & (facing > 0)
            open_ &= ~scene.ray_test(shadow, open_)
            lit += dr.select(open_, light * facing, 0)
        brought += dr.select(alive, carried * lit, 0)
        dr.eval(at, normal, alive, carried, brought)
    return brought


def _mean_of(light: Any, size: int, paths: int) -> NDArray[np.float32]:
    """Return the pixels' means of what each of their paths has found."""
    each = np.array(light).T.reshape(size, size, paths, 3)
    return np.asarray(each.mean(axis=2, dtype=np.float64), np.float32)


def wall_mesh(job: Job) -> tuple[Places, Places, Places]:
    """Return the zero set of a field as world points, normals and triangles.

    refined: grid points for each of the field's spacing, by linear interpolation: the
    surface stays the same, its triangles shrink. The normals are those of Sobel's
    gradients between grid points, towards negative values.
    """
    values = np.load(job["values"], allow_pickle=False)
    spacing, origin = np.array(job["spacing_mm"]), np.array(job["origin_mm"])
    finer = values
    for axis in range(3):
        finer = _refined(finer, axis, job["refined"])
    image = vtkImageData()
    image.SetDimensions(*finer.shape[::-1])
    image.SetSpacing(*(spacing / job["refined"]))
    image.SetOrigin(*origin)
    flat = np.ascontiguousarray(finer).ravel()
    image.GetPointData().SetScalars(vtk_arrays.numpy_to_vtk(flat, deep=True))
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.0)
    edges.ComputeNormalsOff()
    edges.Update()
    surface = edges.GetOutput()
    points = vtk_arrays.vtk_to_numpy(surface.GetPoints().GetData()).astype(float)
    corners = surface.GetPolys().GetConnectivityArray()
    faces = vtk_arrays.vtk_to_numpy(corners).reshape(-1, 3)
    voxels = ((points - origin) / spacing).T[::-1]
    gradient = np.stack(
        [
            map_coordinates(sobel(values, 2 - k), voxels, order=1, mode="nearest")
            / spacing[k]
            for k in range(3)
        ],
        axis=-1,
    )
    length = np.linalg.norm(gradient, axis=-1, keepdims=True)
    return points, -gradient / np.maximum(length, 1e-12), faces


def _refined(values: NDArray[np.float32], axis: int, times: int) -> NDArray[np.float32]:
    """Put points between those of one axis, by linear interpolation."""
    rows = np.moveaxis(values, axis, 0)
    parts = [rows[:-1] + t / times * (rows[1:] - rows[:-1]) for t in range(times)]
    between = np.stack(parts, axis=1).reshape(-1, *rows.shape[1:])
    return np.moveaxis(np.concatenate([between, rows[-1:]]), 0, axis)


if __name__ == "__main__":
    serve(LightPeer().work)
