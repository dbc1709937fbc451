"""Run a recorded session again, without the device: same frames, same score."""

from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from disk import UserError
from paravol.patient import OperatingRoom, Progress, prepare_room
from paravol.session_setup import build_session, build_view
from paravol.video import VideoWriter
from paravol.view import Frame
from renderers.scene.thread_team import Errand
from renderers.shading import LOOK_VERSION
from scenarios import Sample, Scenario, Score
from scenarios.bundle import Damage, FrameRecord, SampleRecord, read_recording

VIDEO_FPS = 30.0


@dataclass(frozen=True, slots=True)
class ReplayReport:
    """Say what a replay found.

    complete: the recording was closed properly.
    differing_frames, differing_clearances: numbers of the frames whose picture or
        whose clearance differs from the recorded one.
    same_look: whether the recording is of the look that this version draws; the
        pictures of another look are drawn but not compared.
    score: computed again from the recorded poses.
    same_score: whether it equals the recorded one, figure by figure, the names of
        structures only where this version gives the same; None when the recording
        ended before it had one, or is damaged.
    damages: parts of the recording that cannot be read; the rest was run.
    seconds: of flight from the first sample to the last.
    """

    complete: bool
    samples: int
    frames: int
    differing_frames: list[int]
    differing_clearances: list[int]
    score: Score
    same_score: bool | None
    same_look: bool
    damages: tuple[Damage, ...]
    seconds: float

    @property
    def good_s(self) -> float:
        """Get the seconds of flight that could be read."""
        return self.seconds - sum(lost.to_s - lost.from_s for lost in self.damages)

    @property
    def is_exact(self) -> bool:
        """Tell whether all came out again as recorded, as far as it was recorded."""
        return not (
            self.damages
            or self.differing_frames
            or self.differing_clearances
            or self.same_score is False
        )


def replay_session(
    folder: Path,
    *,
    threads: int,
    progress: Progress,
    video: Path | None = None,
    room: OperatingRoom | None = None,
) -> ReplayReport:
    """Draw every recorded frame again and score every sample again.

    room: the head, when the caller has it already.
    Raises ValueError when the session cannot be read, or was flown through another
    head than this version of the program builds.
    """
    info, records, complete, damages, places = read_recording(folder)
    film = None if video is None else VideoWriter(video, info.picture_size, VIDEO_FPS)
    scenario = msgspec.json.decode(info.scenario, type=Scenario)
    room = room or prepare_room(scenario, progress)
    if room.surface_sha256 != info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head (surface "
            f"{info.surface_sha256[:12]}, now {room.surface_sha256[:12]}): this "
            "version of the program builds it differently, so the pictures cannot "
            "match."
        )
    session = build_session(
        scenario,
        room,
        np.array(info.world_from_device).reshape(4, 4),
        info.picture_size,
    )
    view = build_view(
        scenario,
        room,
        tier=info.tier,
        seed=info.seed,
        has_instrument=info.has_instrument,
        threads=threads,
    )
    same_look = info.look == LOOK_VERSION
    frames = 0
    last: Errand[Frame] | None = None
    pictures: list[int] = []
    clearances: list[int] = []
    samples: list[Sample] = []

    def check(record: FrameRecord, time_s: float, frame: Frame) -> None:
        if same_look and frame.fingerprint() != record.xxh3_128:
            pictures.append(record.number)
        if film is not None:
            film.show_until(frame.pixels, time_s)

    with ExitStack() as stack:
        if film is not None:
            stack.enter_context(film)
        # interrupted, no frame is still in the making when the film is closed
        stack.callback(view.settle)
        for index, record in enumerate(records):
            if isinstance(record, SampleRecord):
                sample = record.sample()
                session.step(sample)
                samples.append(sample)
            elif (
                isinstance(record, FrameRecord)
                and (place := places.get(record.sample)) is not None
                and place < len(samples)
            ):
                # A frame is recorded when it is finished; newer samples have come in.
                shown = samples[place]
                seen = session.view(shown)
                last = view.begin(
                    seen,
                    number=record.number,
                    elapsed_s=0.0,
                    gain=record.gain,
                    then=partial(check, record, shown.time_s),
                )
                frames += 1
                if seen.clearance_mm != record.clearance_mm:
                    clearances.append(record.number)
            progress("Replaying", (index + 1) / len(records))
        view.settle()
        if film is not None and last is not None:
            # the last frame was still to be seen when the flight ended
            film.show_until(last.result().pixels, samples[-1].time_s)
    score = session.score()
    return ReplayReport(
        complete=complete,
        samples=len(samples),
        frames=frames,
        differing_frames=pictures,
        differing_clearances=clearances,
        score=score,
        same_score=None
        if damages
        else _same_score(
            folder,
            score,
            room.structures is not None
            and room.structures.sha256() == info.structures_sha256,
        ),
        same_look=same_look,
        damages=damages,
        seconds=samples[-1].time_s - samples[0].time_s if samples else 0.0,
    )


class _Recorded(msgspec.Struct):
    """The part of result.json that a replay computes again."""

    score: dict[str, Any]


_FIRST_FIGURES = frozenset(
    (
        "duration_s",
        "path_length_mm",
        "min_clearance_mm",
        "contacts",
        "target_distance_mm",
    )
)
"""Figures that every recorded score has."""

_NAMES = frozenset(("worst_structure", "touched_s"))
"""Figures that depend on how the head's structures are named."""


def _same_score(folder: Path, score: Score, same_names: bool) -> bool | None:
    """Compare what was recorded; older recordings have fewer figures."""
    try:
        raw = (folder / "result.json").read_bytes()
    except FileNotFoundError:
        return None
    try:
        recorded = msgspec.json.decode(raw, type=_Recorded).score
    except msgspec.DecodeError as error:
        raise UserError(f"{folder}/result.json is not valid: {error}.") from error
    lacking = sorted(_FIRST_FIGURES - recorded.keys())
    if lacking:
        raise UserError(
            f"{folder}/result.json is not valid: its score has no {lacking[0]}."
        )
    compared = recorded if same_names else recorded.keys() - _NAMES
    found = asdict(score)
    return all(name in found and found[name] == recorded[name] for name in compared)
