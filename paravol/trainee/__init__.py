"""What a trainee comes back to: exercises and results, cases, devices, choices."""

from paravol.trainee.cases import KnownCase, add_case, case_at, is_case, known_cases
from paravol.trainee.choices import ChoiceFile, Choices
from paravol.trainee.exercises import Exercise, Ladder, ladder_of, learns
from paravol.trainee.found_devices import FoundDevice, find_devices
from paravol.trainee.record import TraineeRecord, record_of
from paravol.trainee.session_result import (
    ResultOrder,
    SessionResult,
    result_of_session,
)

__all__ = [
    "ChoiceFile",
    "Choices",
    "Exercise",
    "FoundDevice",
    "KnownCase",
    "Ladder",
    "ResultOrder",
    "SessionResult",
    "TraineeRecord",
    "add_case",
    "case_at",
    "find_devices",
    "is_case",
    "known_cases",
    "ladder_of",
    "learns",
    "record_of",
    "result_of_session",
]
