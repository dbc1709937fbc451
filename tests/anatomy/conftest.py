from collections.abc import Callable

import numpy as np
import pytest

from anatomy.kernels import stack_program as kernels
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.program import Encoder
from anatomy.phantom.shapes import Array, Field


@pytest.fixture(scope="session")
def run() -> Callable[..., Array]:
    """Compile a field to a program and give its values at points.

    The third argument is how many points make a layer, see `kernels.run_program`.
    """

    def evaluate(field: Field, points: Array, layer: int = 0) -> Array:
        encoder = Encoder()
        field.encode(encoder)
        encoder.finish_field()
        program = encoder.program()
        n = points.shape[1]
        begin, end = program.spans[0]
        stack = np.zeros((program.depth, n), dtype=np.float32)
        kernels.run_program(
            program.code,
            program.constants,
            begin,
            end,
            points.astype(np.float32),
            np.zeros((2, n), dtype=np.float32),
            n,
            layer or n,
            stack,
            np.zeros((1, n), dtype=np.float32),
        )
        value: Array = stack[0].astype(np.float64)
        return value

    return evaluate


@pytest.fixture(scope="session")
def phantom() -> Phantom:
    """The default head at 1 mm: enough for volumes, labels and files."""
    return build_phantom(PhantomParameters(), 1.0)


@pytest.fixture(scope="session")
def nose() -> Phantom:
    """The nasal cavity alone, at the default spacing, with a deviated septum."""
    box = ((-13.0, 13.0), (-23.0, 62.0), (-12.0, 40.0))
    return build_phantom(PhantomParameters(), 0.5, field_mm=box)
