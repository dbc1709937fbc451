"""Files, written whole or not at all and read without trust; errors of users."""

from disk.foreign_file import ForeignFileError, foreign_file
from disk.place import demand_place
from disk.simple_itk import simple_itk
from disk.user_error import UserError
from disk.whole_file import whole_file

__all__ = [
    "ForeignFileError",
    "UserError",
    "demand_place",
    "foreign_file",
    "simple_itk",
    "whole_file",
]
