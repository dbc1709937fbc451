"""The skull base: the lower limit of brain and its fluid, over the whole head."""

from anatomy.phantom.ethmoid import fovea
from anatomy.phantom.honeycomb import Recall
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.rows import Row
from anatomy.phantom.shapes import Affine, Field, Table, U, depth_table, z

FOSSA_MM = 3.6
"""Half width of both olfactory fossae together, at the lateral lamellae."""


def skull_base(parameters: PhantomParameters) -> Field:
    """Give the height of the brain's lower limit: fovea, fossa, orbital roof."""
    rise = Table(U, (10, 20, 32, 44), (0, 4.0, 7.0, 6.0), 4.0) * depth_table(
        [-5, 10, 35, 55], [0.3, 1.0, 0.8, 0.0], 4.0
    )
    fossa = Table(U, (FOSSA_MM - 0.3, FOSSA_MM + 0.7), (1.0, 0.0), 0.3)
    reach = depth_table([6, 12, 34, 42], [0.0, 1.0, 1.0, 0.0], 3.0)
    sella = Table(U, (0, 5, 8), (1.0, 1.0, 0.0), 2.0) * depth_table(
        [63, 68, 77, 81], [0.0, 1.0, 1.0, -0.3], 2.0
    )
    # Over the sphenoid the planum lies lower than the fovea's line would lead.
    return (
        fovea(parameters)
        + rise
        - fossa * reach * Affine(parameters.keros_mm - 0.9)
        - sella * Affine(4.2)
    )


def below_base(parameters: PhantomParameters) -> Field:
    """Recall the depth below the skull base, which the common marks leave."""
    return Recall(Row.BASE, skull_base(parameters) - z)
