"""Files: written whole or not at all, read without trusting who wrote them."""

from disk.foreign_file import ForeignFileError, foreign_file
from disk.place import demand_place
from disk.whole_file import whole_file

__all__ = ["ForeignFileError", "demand_place", "foreign_file", "whole_file"]
