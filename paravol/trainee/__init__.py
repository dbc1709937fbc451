"""What a trainee comes back to: exercises and results, cases, devices, choices.

`record` and `session_result` load the progress store, so they are not listed here.
"""

from paravol.trainee.cases import KnownCase, add_case, case_at, is_case, known_cases
from paravol.trainee.choices import ChoiceFile, Choices
from paravol.trainee.exercises import Exercise, Ladder, ladder_of, learns
from paravol.trainee.found_devices import FoundDevice, find_devices

__all__ = [
    "ChoiceFile",
    "Choices",
    "Exercise",
    "FoundDevice",
    "KnownCase",
    "Ladder",
    "add_case",
    "case_at",
    "find_devices",
    "is_case",
    "known_cases",
    "ladder_of",
    "learns",
]
