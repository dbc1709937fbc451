from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paravol.sessions.video import VideoWriter

# The reading half of imageio-ffmpeg 0.8 leaves its pipes to the garbage collector.
pytestmark = pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)


def picture(level: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.full((32, 48, 3), level, np.uint8)


def test_uneven_frames_keep_their_times(tmp_path: Path) -> None:
    file = tmp_path / "film.mp4"
    times = [0.0, 0.11, 0.12, 0.5, 0.98]
    with VideoWriter(file, (48, 32), 30.0) as film:
        for i, time_s in enumerate(times):
            film.show_until(picture(40 * i), time_s)
    count, _ = imageio_ffmpeg.count_frames_and_secs(file)
    assert count == int(0.98 * 30) + 1
    reader = imageio_ffmpeg.read_frames(file)
    size = next(reader)["size"]
    assert size == (48, 32)
    levels = [np.frombuffer(f, np.uint8).mean() for f in reader]
    # the frame of .5 s fills the film from just after .12 s on
    assert levels[10] == pytest.approx(120, abs=4)


@pytest.mark.parametrize("name", ["film.txt", "film", "folder.mp4"])
def test_a_film_is_an_mp4_file(name: str, tmp_path: Path) -> None:
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(ValueError, match=r"goes to an \.mp4 file"):
        VideoWriter(tmp_path / name, (48, 32), 30.0)


def test_a_film_without_a_place_is_refused_before_the_first_frame() -> None:
    film = VideoWriter(Path("/proc/film.mp4"), (48, 32), 30.0)
    with pytest.raises(OSError, match="No such file") as caught, film:
        pass
    assert caught.value.filename == "/proc/film.mp4"


def test_no_frames_are_no_film(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "film.mp4", (48, 32), 30.0):
        pass
    assert list(tmp_path.iterdir()) == []


def fail_in_the_middle(file: Path) -> None:
    with VideoWriter(file, (48, 32), 30.0) as film:
        film.add(picture(9))
        raise RuntimeError("stop")


def test_a_failed_film_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="stop"):
        fail_in_the_middle(tmp_path / "film.mp4")
    assert list(tmp_path.iterdir()) == []


@settings(max_examples=10)
@given(st.integers(1, 99), st.integers(1, 99))
def test_odd_sizes_are_refused(width: int, height: int) -> None:
    if width % 2 == 0 and height % 2 == 0:
        return
    with pytest.raises(ValueError, match="even"):
        VideoWriter(Path("never.mp4"), (width, height), 30.0)
