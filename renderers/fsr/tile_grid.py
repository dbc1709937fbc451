"""How many tiles a picture is cut into."""

from disk import UserError


def tile_grid(
    height: int, width: int, tile: tuple[int, int], most: int
) -> tuple[int, int]:
    """Give the tiles down and across a picture of `height` x `width` pixels.

    tile: height and width of one. Raises ValueError for a picture of more than `most`
    either way.
    """
    down, across = -(-height // tile[0]), -(-width // tile[1])
    if max(down, across) > most:
        raise UserError(
            f"a picture may have {most * tile[1]} x {most * tile[0]} pixels, got "
            f"{width} x {height}"
        )
    return down, across
