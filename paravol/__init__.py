"""The trainer without a screen: patients, pictures, flights, replays, snapshots.

``import paravol`` loads nothing large; what is named here is loaded when it is first
used. See docs/python.md.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from paravol.public import (
        HighQualityPicture,
        Look,
        PatientScene,
        RecordedSession,
        ReplayedFrame,
        ReplayReport,
        SessionTimeline,
        flight_pose,
        instrument,
        load,
        phantom,
        read_session,
        replay,
        replay_frames,
        scene,
    )
else:

    def __getattr__(name: str) -> object:
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        # Before anything imports the compiler.
        from paravol.environment import prepare_environment

        prepare_environment()
        import paravol.public

        return getattr(paravol.public, name)


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
