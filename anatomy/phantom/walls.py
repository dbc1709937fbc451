"""Surfaces that bound two spaces, so that both agree on where the wall is."""

from anatomy.phantom.shapes import Field, height_table


def lateral_wall() -> Field:
    """Give the lateral position of the nasal cavity's side wall over the height.

    It steps inwards where the ethmoid begins: the roof of the middle meatus.
    """
    return height_table(
        [-20, 2, 8, 20, 25, 29, 60], [11.5, 12.6, 13.2, 13.0, 10.9, 4.3, 3.3], 1.0
    )


def sphenoid_face() -> Field:
    """Give the depth y of the wall between nose and sphenoid over the height."""
    return height_table(
        [16, 20, 22.5, 25, 44, 80], [-60, -59, -56.6, -53.6, -52, -47], 1.0
    )
