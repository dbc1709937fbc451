import pytest

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom


@pytest.fixture(scope="session")
def phantom() -> Phantom:
    """The default head at 1 mm."""
    return build_phantom(PhantomParameters(), 1.0)


@pytest.fixture(scope="session")
def nose() -> Phantom:
    """The nasal cavity alone, at the default spacing, with a deviated septum."""
    box = ((-13.0, 13.0), (-23.0, 62.0), (-12.0, 40.0))
    return build_phantom(PhantomParameters(), 0.5, field_mm=box)
