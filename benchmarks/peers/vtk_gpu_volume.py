"""VTK's ray caster for graphics cards, by software OpenGL where there is none."""

from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper

from benchmarks.peers.job_loop import serve
from benchmarks.peers.vtk_volume import VtkVolumePeer


def gpu_mapper() -> vtkOpenGLGPUVolumeRayCastMapper:
    """Give it without jitter: its pictures are compared."""
    mapper = vtkOpenGLGPUVolumeRayCastMapper()
    mapper.SetUseJittering(False)
    return mapper


if __name__ == "__main__":
    serve(VtkVolumePeer(gpu_mapper()).work)
