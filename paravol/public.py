"""What ``import paravol`` gives; see docs/python.md."""

from paravol.looks import HighQualityPicture, Look, instrument, load, phantom, scene
from paravol.looks import Patient as PatientScene
from paravol.sessions.session_replay import (
    RecordedSession,
    ReplayedFrame,
    ReplayReport,
    read_session,
    replay_frames,
)
from paravol.sessions.session_replay import replay_session as replay
from paravol.sessions.session_setup import flight_pose
from paravol.sessions.session_timeline import SessionTimeline

__all__ = [
    "HighQualityPicture",
    "Look",
    "PatientScene",
    "RecordedSession",
    "ReplayReport",
    "ReplayedFrame",
    "SessionTimeline",
    "flight_pose",
    "instrument",
    "load",
    "phantom",
    "read_session",
    "replay",
    "replay_frames",
    "scene",
]
