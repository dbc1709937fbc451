"""What a trainee comes back to: exercises and results, cases, devices, choices."""

from paravol.trainee.cases import KnownCase, add_case, case_at, known_cases
from paravol.trainee.exercises import Exercise, Ladder, ladder_of, learns
from paravol.trainee.found_devices import FoundDevice, find_devices
from paravol.trainee.preferences import PreferenceFile, Preferences
from paravol.trainee.session_result import (
    ResultOrder,
    SessionResult,
    result_of_session,
)

__all__ = [
    "Exercise",
    "FoundDevice",
    "KnownCase",
    "Ladder",
    "PreferenceFile",
    "Preferences",
    "ResultOrder",
    "SessionResult",
    "add_case",
    "case_at",
    "find_devices",
    "known_cases",
    "ladder_of",
    "learns",
    "result_of_session",
]
