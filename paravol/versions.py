"""Which versions of what made a result."""

import platform
import sys
from importlib.metadata import PackageNotFoundError, version

_NAMED = ("paravol-ess", "numpy", "numba", "scipy", "vtk", "trimesh", "mpi4py")


def versions() -> dict[str, str]:
    """Return the versions of Python, the machine and the packages that matter."""
    found = {
        "python": platform.python_version(),
        "platform": f"{sys.platform}-{platform.machine()}",
    }
    for name in _NAMED:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
