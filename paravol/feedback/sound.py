"""A loudspeaker for a flight: it plays the newest cues, or nothing where there is none.

Played by miniaudio, which brings its own library for every system and finds the
system's sound server at run time; of the others, sounddevice needs PortAudio installed
by hand on Linux, and Qt's own needs 170 MB of further parts. It is loaded only here
and only when sound is wanted.
"""

import ctypes
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from typing import Any

from paravol.feedback.tones import RATE_HZ, SILENCE, Cues, Synthesizer, Tick
from paravol.feedback.touch_signs import TouchSigns
from system import UserError

BUFFER_MS = 40
"""As long as samples wait: a hand feels sound as its own up to about 50 ms."""

STALE_S = 0.5
"""Cues older than this are not played: what is shown is no longer live."""

STEP = 0.1
"""One step of the volume."""

LOUDEST = 0.5
"""Amplitude at full volume: beside the voice of an instructor, not above it."""

NO_LIBRARY = (
    "No sound: miniaudio is not installed (pip install 'paravol-ess[desktop]')."
)
NO_DEVICE = "No sound: this machine has no loudspeaker."

BACKENDS = "WASAPI", "COREAUDIO", "PULSEAUDIO", "ALSA"
"""Sound systems that are tried, in this order. Not the null device, which swallows
samples: whoever hears nothing is to be told so. Not JACK, which writes to the terminal
where no server runs."""

ALSA_NULL = "Discard all samples"
"""What ALSA calls its null device, which plays nothing."""


class SoundPlayer:
    """Play cues in a thread of the sound library's own.

    No call waits for the sound system: it is opened beside, since a sound server may
    take seconds to answer. May be called by any thread.
    """

    def __init__(
        self,
        *,
        is_on: bool = True,
        volume: float = 1.0,
        told: Callable[[str], object] = lambda text: None,
        open_device: Callable[[], Any] | None = None,
    ) -> None:
        """Begin silent; see `start`.

        told: hears once, from a thread of its own, why there is no sound.
        open_device: opens a device of miniaudio, for whoever has another.
        """
        self.is_on = is_on
        self.volume = volume
        self._told = told
        self._open_device = open_device or _open_device
        self._cues = SILENCE
        self._heard_s = 0.0
        self._struck: deque[Tick] = deque(maxlen=8)
        self._device: Any = None
        self._is_closed = False
        self._has_begun = False
        self._lock = threading.Lock()

    def start(self) -> None:
        """Open the loudspeaker, if sound is on; later calls do nothing."""
        with self._lock:
            if self._has_begun or not self.is_on or self._is_closed:
                return
            self._has_begun = True
        threading.Thread(target=self._open, name="sound", daemon=True).start()

    def follow(self, signs: TouchSigns) -> None:
        """Play these signs from now on, for `STALE_S` at most."""
        self._cues = Cues(signs.hazard_mm, signs.share)
        self._heard_s = time.monotonic()

    def strike(self, tick: Tick) -> None:
        """Play a tick."""
        if self.is_on:
            self._struck.append(tick)

    def quiet(self) -> None:
        """Fall silent until the next signs."""
        self._cues = SILENCE
        self._struck.clear()

    def switch(self) -> bool:
        """Turn sound on or off; return whether it is on now."""
        self.is_on = not self.is_on
        self.start()
        return self.is_on

    def louder(self, steps: int) -> float:
        """Change the volume by so many steps; return it, 0 to 1."""
        self.volume = min(max(round(self.volume + steps * STEP, 6), 0.0), 1.0)
        return self.volume

    def close(self) -> None:
        """Let go of the loudspeaker; harmless when repeated."""
        with self._lock:
            self._is_closed = True
            device, self._device = self._device, None
        if device is not None:
            device.close()

    def cues(self, now_s: float) -> Cues:
        """Return what is to be heard at this time of the monotonic clock."""
        cues = self._cues
        if not self.is_on or now_s - self._heard_s > STALE_S:
            return cues._replace(volume=0.0)
        return cues._replace(volume=min(cues.volume, self.volume * LOUDEST))

    def blocks(self) -> Generator[bytes, int, None]:
        """Yield samples, float32, as many as are asked for by `send`."""
        synthesizer = Synthesizer()
        count = yield b""
        while True:
            while self._struck:
                synthesizer.strike(self._struck.popleft())
            block = synthesizer.block(count, self.cues(time.monotonic()))
            count = yield block.tobytes()

    def _open(self) -> None:
        try:
            device = self._open_device()
            blocks = self.blocks()
            next(blocks)
            device.start(blocks)
        except ImportError:
            self._told(NO_LIBRARY)
        except Exception as error:
            # whatever the sound system says: nobody ends a flight for it
            self._told(f"{NO_DEVICE} ({error.args[0] if error.args else error})")
        else:
            with self._lock:
                if not self._is_closed:
                    self._device = device
                    return
            device.close()


def loudspeakers() -> list[str]:
    """Return the names of the system's loudspeakers.

    UserError, in one sentence, where there can be none.
    """
    try:
        import miniaudio
    except ImportError as error:
        raise UserError(NO_LIBRARY) from error
    try:
        found = miniaudio.Devices(_backends(miniaudio)).get_playbacks()
    except miniaudio.MiniaudioError as error:
        said = error.args[0] if error.args else error
        raise UserError(f"{NO_DEVICE} ({said})") from error
    names = [str(each["name"]) for each in found]
    return [name for name in names if not name.startswith(ALSA_NULL)]


def _open_device() -> Any:
    """Open the system's loudspeaker; ImportError or miniaudio's error without one."""
    import miniaudio

    return miniaudio.PlaybackDevice(
        output_format=miniaudio.SampleFormat.FLOAT32,
        nchannels=1,
        sample_rate=RATE_HZ,
        buffersize_msec=BUFFER_MS,
        backends=_backends(miniaudio),
        app_name="PARAVOL",
    )


def _backends(miniaudio: Any) -> list[Any]:
    _silence_alsa()
    return [getattr(miniaudio.Backend, name) for name in BACKENDS]


# kept, since the library calls it at any time
_HANDLER = ctypes.CFUNCTYPE(
    None,
    ctypes.c_char_p,
    ctypes.c_int,
    ctypes.c_char_p,
    ctypes.c_int,
    ctypes.c_char_p,
)
_say_nothing = _HANDLER(lambda *_: None)


def _silence_alsa() -> None:
    """Keep ALSA, Linux's sound library, from writing each failure to the terminal."""
    try:
        library = ctypes.CDLL("libasound.so.2")
    except OSError:
        return
    library.snd_lib_error_set_handler(_say_nothing)
