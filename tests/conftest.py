"""What every test runs under: compiled kernels cached, nothing of the user's own."""

import gc
import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from paravol.environment import prepare_environment

prepare_environment()

# Examples are few, because most laws here render something; no deadline, because the
# first example of a kernel may compile it. A build must give the same answer twice.
settings.register_profile("local", max_examples=25, deadline=None)
settings.register_profile("ci", max_examples=25, deadline=None, derandomize=True)
settings.register_profile("search", max_examples=400, deadline=None)
settings.load_profile("ci" if os.environ.get("CI") else "local")


def pytest_collection_finish() -> None:
    """Look through thousands of collected tests at no later collection of garbage."""
    gc.freeze()


@pytest.fixture(autouse=True, scope="session")
def nothing_of_the_users(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the user's cases, settings and screen out of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME"):
            patch.setenv(name, str(tmp_path_factory.mktemp(name.lower())))
        patch.setenv("MPLBACKEND", "Agg")
        yield
