"""The folder through which pictures are asked for and delivered.

    spool/
      queue/<priority>-<id>.json   requests, published by rename
      jobs/<id>/request.json       a claimed request: a hard link to its queue entry
                attempt-<n>        made by the one worker that makes attempt n
                status.json        state, attempt, heartbeat, share done, message
                cancel             made by the client
                finish             likewise: what there is will do
                picture.png radiance.npy depth.npy samples.npy
                result.json        written last
      data/<sha256>                arrays

It survives crashes of either side, works across machines that share a disk, and can be
looked at with `ls`. The folder belongs to one user, mode 0700: whoever may write into
it may have pictures drawn. Heartbeats are judged by the reader's own clock since the
counter last changed; clocks of two machines are never compared.
"""

import os
import stat
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import msgspec
from msgspec import Struct

from renderers.art.data_store import DataStore
from renderers.art.files import write_whole
from renderers.art.job import LARGEST_REQUEST, SnapshotRequest, SnapshotResult

LEASE_S = 15.0
"""Silence after which a worker counts as dead; heartbeats come every 2 s."""


class SpoolError(RuntimeError):
    """The spool folder cannot be used."""


class JobState(Enum):
    """Name how far a job has come."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    CANCELLED = "cancelled"
    REJECTED = "rejected"
    FAILED = "failed"

    @property
    def is_final(self) -> bool:
        """Tell whether nothing more will happen."""
        return self not in (JobState.QUEUED, JobState.RUNNING)


class JobStatus(Struct, frozen=True, forbid_unknown_fields=True):
    """Tell how a job stands. done: share of the picture. message: why it ended."""

    state: JobState
    attempt: int = 0
    heartbeat: int = 0
    done: float = 0.0
    message: str = ""


@dataclass(frozen=True, slots=True)
class _Sign:
    """Remember when a job's heartbeat was last seen to change."""

    heartbeat: tuple[int, int]
    seen_s: float


class Spool:
    """Open a spool folder, making it when it is not there."""

    def __init__(
        self, folder: Path, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Raise SpoolError in one sentence when the folder cannot be used.

        clock: seconds, to judge the silence of workers by.
        """
        self._clock = clock
        self.folder = folder
        self._queue, self._jobs = folder / "queue", folder / "jobs"
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            info = folder.stat()
            if not stat.S_ISDIR(info.st_mode):
                raise SpoolError(f"Spool {folder} is not a folder.")
            if info.st_uid != os.geteuid():
                raise SpoolError(f"Spool {folder} belongs to another user.")
            if info.st_mode & 0o077 and not any(folder.iterdir()):
                folder.chmod(0o700)
            elif info.st_mode & 0o077:
                raise SpoolError(
                    f"Spool {folder} is open to other users; run chmod 700 on it."
                )
            for part in (self._queue, self._jobs, folder / "data"):
                part.mkdir(mode=0o700, exist_ok=True)
                if not os.access(part, os.W_OK | os.X_OK):
                    raise SpoolError(f"Spool {folder} cannot be written.")
        except OSError as error:
            raise SpoolError(
                f"Spool {folder} cannot be used: {error.strerror}."
            ) from error
        self.data = DataStore(folder / "data")
        self._signs: dict[str, _Sign] = {}

    def job_folder(self, job_id: str) -> Path:
        """Get where a job's files are."""
        return self._jobs / job_id

    def publish(self, request: SnapshotRequest) -> None:
        """Queue a request. The same request again is answered by the same job.

        Raise SpoolError when its id was used for another request.
        """
        record = msgspec.json.encode(request)
        known = self._known(request.id)
        if known is None:
            write_whole(self._queue / f"{request.priority}-{request.id}.json", record)
        elif known != record:
            raise SpoolError(f"Job {request.id} already asks for something else.")

    def claim(self) -> tuple[str, bytes] | None:
        """Take the first request that nobody else took; return its id and bytes."""
        for entry in self._queued():
            job_id = entry.stem.partition("-")[2]
            folder = self.job_folder(job_id)
            folder.mkdir(mode=0o700, exist_ok=True)
            request = folder / "request.json"
            try:
                os.link(entry, request)
            except FileExistsError:
                # Taken already, or published twice; the job answers for both. While
                # the one who takes it has not begun, the entry is still counted.
                if self._attempts(job_id):
                    entry.unlink(missing_ok=True)
                continue
            except FileNotFoundError:
                continue
            # Over NFS a link may have been made although the call failed, and the
            # other way round; the count is what both machines agree on.
            if request.stat().st_nlink != 2 or not self.begin_attempt(job_id, 1):
                continue
            entry.unlink(missing_ok=True)
            return job_id, _read_request(request)
        return None

    def take_over(self, lease_s: float = LEASE_S) -> tuple[str, bytes, int] | None:
        """Take a job whose worker fell silent; return its id, bytes and attempt."""
        for request in sorted(self._jobs.glob("*/request.json")):
            job_id = request.parent.name
            status = self.status(job_id)
            if status.state.is_final or not self.is_stale(job_id, status, lease_s):
                continue
            attempt = max(status.attempt, self._attempts(job_id)) + 1
            if self.begin_attempt(job_id, attempt):
                self._signs.pop(job_id, None)
                # one that died while claiming left its entry in the queue
                for entry in self._queue.glob(f"[0-9]-{job_id}.json"):
                    entry.unlink(missing_ok=True)
                return job_id, _read_request(request), attempt
        return None

    def begin_attempt(self, job_id: str, attempt: int) -> bool:
        """Make attempt n ours; False when another worker was quicker."""
        try:
            os.close(
                os.open(
                    self.job_folder(job_id) / f"attempt-{attempt}",
                    os.O_CREAT | os.O_EXCL | os.O_WRONLY,
                    0o600,
                )
            )
        except FileExistsError:
            return False
        self.set_status(job_id, JobStatus(JobState.RUNNING, attempt))
        return True

    def is_stale(self, job_id: str, status: JobStatus, lease_s: float) -> bool:
        """Tell whether a running job's heartbeat has stood still for `lease_s`.

        The clock starts when this object first looks at the job.
        """
        heartbeat = status.attempt, status.heartbeat
        sign = self._signs.get(job_id)
        if sign is None or sign.heartbeat != heartbeat:
            self._signs[job_id] = _Sign(heartbeat, self._clock())
            return False
        return self._clock() - sign.seen_s > lease_s

    def status(self, job_id: str) -> JobStatus:
        """Read a job's status; QUEUED when nobody has taken it."""
        path = self.job_folder(job_id) / "status.json"
        try:
            return msgspec.json.decode(path.read_bytes(), type=JobStatus)
        except FileNotFoundError:
            return JobStatus(JobState.QUEUED)
        except msgspec.DecodeError as error:
            raise SpoolError(f"Status of job {job_id} is damaged: {error}.") from error

    def set_status(self, job_id: str, status: JobStatus) -> None:
        """Replace a job's status; only the worker whose attempt it is may."""
        write_whole(
            self.job_folder(job_id) / "status.json", msgspec.json.encode(status)
        )

    def owns(self, job_id: str, attempt: int) -> bool:
        """Tell whether attempt n is still the last one."""
        return self._attempts(job_id) == attempt

    def ask_cancel(self, job_id: str) -> None:
        """Wish that a job ends; harmless when it has ended."""
        self.job_folder(job_id).mkdir(mode=0o700, exist_ok=True)
        (self.job_folder(job_id) / "cancel").touch(mode=0o600)

    def is_cancelled(self, job_id: str) -> bool:
        """Tell whether the client wished the job to end."""
        return (self.job_folder(job_id) / "cancel").exists()

    def ask_finish(self, job_id: str) -> None:
        """Wish for the best picture so far; harmless when the job has ended."""
        self.job_folder(job_id).mkdir(mode=0o700, exist_ok=True)
        (self.job_folder(job_id) / "finish").touch(mode=0o600)

    def is_enough(self, job_id: str) -> bool:
        """Tell whether the client wished for the best picture so far."""
        return (self.job_folder(job_id) / "finish").exists()

    def result(self, job_id: str) -> SnapshotResult:
        """Read the result of a job that is DONE."""
        path = self.job_folder(job_id) / "result.json"
        try:
            return msgspec.json.decode(path.read_bytes(), type=SnapshotResult)
        except (OSError, msgspec.DecodeError) as error:
            raise SpoolError(
                f"Result of job {job_id} cannot be read: {error}."
            ) from error

    def _queued(self) -> list[Path]:
        entries = []
        for path in self._queue.glob("[0-9]-*.json"):
            try:
                entries.append((path.name[0], path.stat().st_mtime_ns, path))
            except FileNotFoundError:
                continue
        return [path for _, _, path in sorted(entries)]

    def _attempts(self, job_id: str) -> int:
        return len(list(self.job_folder(job_id).glob("attempt-*")))

    def _known(self, job_id: str) -> bytes | None:
        candidates = [self.job_folder(job_id) / "request.json"]
        candidates += self._queue.glob(f"[0-9]-{job_id}.json")
        for path in candidates:
            try:
                return path.read_bytes()
            except FileNotFoundError:
                continue
        return None


def _read_request(path: Path) -> bytes:
    # One byte more than allowed is enough to see that it is too long.
    with path.open("rb") as file:
        return file.read(LARGEST_REQUEST + 1)
