"""Files as every other package writes them: whole or not at all."""

from disk.whole_file import whole_file

__all__ = ["whole_file"]
