"""SimpleITK, which reads and writes other programs' files."""

import importlib
from typing import Any

from system.c_numbers import use_c_numbers


def simple_itk() -> Any:
    """Import SimpleITK late: half a second that most commands can save.

    It carries no types. What it reads and writes from here on has decimal points, also
    in a program of somebody else's that brought its process to another locale.
    """
    use_c_numbers()
    return importlib.import_module("SimpleITK")
