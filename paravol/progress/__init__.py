"""Progress over time: sessions kept in one file, learning curves, cohorts, exports."""

from paravol.progress.cohort import Standing, is_more_better, standings
from paravol.progress.csv_export import as_csv
from paravol.progress.keep_flight import KeptFlight, keep_flight
from paravol.progress.learning_curve import (
    LearningCurve,
    PassRate,
    fit_learning_curve,
    moving_pass_rate,
)
from paravol.progress.session_entry import SessionEntry, demand_name, entry_of_session
from paravol.progress.store import ProgressStore
from paravol.progress.xapi import statements

__all__ = [
    "KeptFlight",
    "LearningCurve",
    "PassRate",
    "ProgressStore",
    "SessionEntry",
    "Standing",
    "as_csv",
    "demand_name",
    "entry_of_session",
    "fit_learning_curve",
    "is_more_better",
    "keep_flight",
    "moving_pass_rate",
    "standings",
    "statements",
]
