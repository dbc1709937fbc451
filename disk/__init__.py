"""Files as every other package writes them: whole or not at all; and foreign ones."""

from disk.foreign import reading
from disk.place import demand_place
from disk.whole_file import whole_file

__all__ = ["demand_place", "reading", "whole_file"]
