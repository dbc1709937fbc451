"""Two eyes beside one another, for a stereo pair."""

import msgspec

from paravol.snapshots.view_file import ScopeLook, ViewCamera, ViewFile


def both_eyes(view: ViewFile, apart_mm: float) -> list[ViewFile]:
    """Return the left and the right eye's view: parallel axes, so far apart."""
    camera = view.to_camera()
    views = []
    for sign in (-0.5, 0.5):
        frame = camera.frame.copy()
        frame[0] += sign * apart_mm * frame[1]
        moved = ViewCamera.of(camera.moved(frame))
        views.append(msgspec.structs.replace(view, camera=moved))
    return views


def exposed(view: ViewFile, gain: float | None) -> ViewFile:
    """Fix the camera's gain, so that two pictures can be compared."""
    if not isinstance(view.look, ScopeLook) or gain is None:
        return view
    look = msgspec.structs.replace(view.look, gain=gain)
    return msgspec.structs.replace(view, look=look)
