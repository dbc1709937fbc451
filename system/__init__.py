"""What is the system's: files kept whole, foreign bytes, locks, processes, typing."""

from system.c_numbers import use_c_numbers
from system.file_lock import NoLocksError, lock_file, locked
from system.foreign_file import ForeignFileError, foreign_file
from system.place import require_place
from system.processes import (
    be_punctual,
    end_group,
    group_options,
    is_alive,
    lower_priority,
    user_number,
)
from system.resources import (
    memory_bytes,
    usable_cores,
    usable_processors,
    use_processors,
)
from system.simple_itk import simple_itk
from system.typed_text import typed_text
from system.user_error import UserError
from system.whole_file import whole_file

__all__ = [
    "ForeignFileError",
    "NoLocksError",
    "UserError",
    "be_punctual",
    "end_group",
    "foreign_file",
    "group_options",
    "is_alive",
    "lock_file",
    "locked",
    "lower_priority",
    "memory_bytes",
    "require_place",
    "simple_itk",
    "typed_text",
    "usable_cores",
    "usable_processors",
    "use_c_numbers",
    "use_processors",
    "user_number",
    "whole_file",
]
