"""What differs between operating systems: locks, numbers, processes, typing."""

from machine.c_numbers import use_c_numbers
from machine.file_lock import NoLocksError, lock_file, locked
from machine.processes import (
    be_punctual,
    end_group,
    group_options,
    is_alive,
    lower_priority,
    user_number,
)
from machine.resources import memory_bytes, usable_cores
from machine.typed_text import typed_text

__all__ = [
    "NoLocksError",
    "be_punctual",
    "end_group",
    "group_options",
    "is_alive",
    "lock_file",
    "locked",
    "lower_priority",
    "memory_bytes",
    "typed_text",
    "usable_cores",
    "use_c_numbers",
    "user_number",
]
