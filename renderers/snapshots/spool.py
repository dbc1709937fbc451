"""The folder through which pictures are asked for and delivered.

    spool/
      queue/<priority>-<id>.json   requests, published by rename
      jobs/<id>/request.json       a claimed request: a hard link to its queue entry
                cancel             made by the client
                finish             likewise: what there is will do
                attempt-<n>/       made by the one worker that makes attempt n
                  status.json      state, heartbeat, share done, message
                  growing.picture  the picture so far, coarse at first
                  *.saved          for whoever takes the job over; gone when it ends
                  picture.png radiance.npy depth.npy samples.npy
                  result.json      written last
      data/<sha256>                arrays

It survives crashes of either side, works across machines that share a disk, and can be
looked at with `ls`. The folder belongs to one user, mode 0700: whoever may write into
it may have pictures drawn. Only the last attempt counts. Each has a folder of its own,
so that a worker which was thought dead and wakes up cannot spoil what came after it.
"""

import os
import stat
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import msgspec
from msgspec import Struct

from renderers.art.job_steps import Step, reached
from renderers.snapshots.data_store import DataStore, make_last, write_whole
from renderers.snapshots.lease import LEASE_S, LeaseWatch
from renderers.snapshots.request import (
    LARGEST_REQUEST,
    SnapshotRequest,
    SnapshotResult,
    decode_request,
    is_job_id,
)
from system import user_number

_ATTEMPT = "attempt-"


SAVE_EVERY_S = 2.0
"""Time between two savings of what a worker has found, at least: at most so much, and
what saving takes, is drawn again by whoever takes the job over. A picture that is
finished sooner is not saved in parts."""


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
        """Return whether the job has ended."""
        return self not in (JobState.QUEUED, JobState.RUNNING)


class JobStatus(Struct, frozen=True, forbid_unknown_fields=True):
    """The state of a job. done: share of the picture. message: why it ended."""

    state: JobState
    attempt: int = 0
    heartbeat: int = 0
    done: float = 0.0
    message: str = ""


class Claim(NamedTuple):
    """A job that is ours to do: its request's bytes, and which attempt this is."""

    job_id: str
    record: bytes
    attempt: int


class Spool:
    """Open a spool folder, making it when it is not there."""

    def __init__(
        self, folder: Path, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Raise SpoolError in one sentence when the folder cannot be used.

        clock: seconds, to judge the silence of workers by.
        """
        self.folder = folder
        self.queue, self.jobs = folder / "queue", folder / "jobs"
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            info = folder.stat()
            if not stat.S_ISDIR(info.st_mode):
                raise SpoolError(f"Spool {folder} is not a folder.")
            user = user_number()
            # without numbers of users there are no bits for others either
            is_open = user is not None and bool(info.st_mode & 0o077)
            if user is not None and info.st_uid != user:
                raise SpoolError(f"Spool {folder} belongs to another user.")
            if is_open and not any(folder.iterdir()):
                folder.chmod(0o700)
            elif is_open:
                raise SpoolError(
                    f"Spool {folder} is open to other users; run chmod 700 on it."
                )
            for part in (self.queue, self.jobs, folder / "data"):
                part.mkdir(mode=0o700, exist_ok=True)
                if not os.access(part, os.W_OK | os.X_OK):
                    raise SpoolError(f"Spool {folder} cannot be written.")
        except OSError as error:
            raise SpoolError(
                f"Spool {folder} cannot be used: {error.strerror}."
            ) from error
        self.data = DataStore(folder / "data")
        self._watch = LeaseWatch(clock)
        self._ended: set[tuple[str, int]] = set()
        """Jobs seen to have ended, by id and inode, which are not looked at again."""

    def job_folder(self, job_id: str) -> Path:
        """Return the folder of a job's files."""
        return self.jobs / job_id

    def attempt_folder(self, job_id: str, attempt: int | None = None) -> Path:
        """Return the folder of an attempt's files; of the last one for None."""
        number = self._last_attempt(job_id) if attempt is None else attempt
        return self.job_folder(job_id) / f"{_ATTEMPT}{number}"

    def publish(self, request: SnapshotRequest) -> None:
        """Queue a request. The same request again is answered by the same job.

        On return it is accepted: no crash of a worker or of the machine loses it.
        Raise UserError that names the field which no worker would accept, SpoolError
        when its id was used for another request.
        """
        record = msgspec.json.encode(request)
        decode_request(record)
        known = self._known(request.id)
        if known is None:
            write_whole(self.queue / f"{request.priority}-{request.id}.json", record)
            reached(Step.REQUEST_PUBLISHED)
        elif known != record:
            raise SpoolError(f"Job {request.id} already asks for something else.")

    def claim(self) -> Claim | None:
        """Claim the first request that no other worker has."""
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
                if self._last_attempt(job_id):
                    entry.unlink(missing_ok=True)
                continue
            except FileNotFoundError:
                continue
            reached(Step.REQUEST_LINKED)
            # Over NFS a link may have been made although the call failed, and the
            # other way round; the count is what both machines agree on.
            if request.stat().st_nlink != 2 or not self.begin_attempt(job_id, 1):
                continue
            # A new name must not be lost when the old one is.
            make_last(folder, self.jobs)
            entry.unlink(missing_ok=True)
            reached(Step.ENTRY_REMOVED)
            return Claim(job_id, _read_request(request), 1)
        return None

    def take_over(self, lease_s: float = LEASE_S) -> Claim | None:
        """Claim a job whose worker fell silent."""
        for job_id in self._unfinished():
            status = self._status(job_id)
            if not self.is_stale(job_id, status, lease_s):
                continue
            attempt = status.attempt + 1
            if self.begin_attempt(job_id, attempt):
                self._watch.forget(job_id)
                # one that died while claiming left its entry in the queue
                for entry in self.queue.glob(f"[0-9]-{job_id}.json"):
                    entry.unlink(missing_ok=True)
                request = self.job_folder(job_id) / "request.json"
                return Claim(job_id, _read_request(request), attempt)
        return None

    def is_quiet(self) -> bool:
        """Return whether every job was taken and has ended, or its worker lives.

        False as well while that is not known: call `take_over` again and again.
        """
        if self._queued():
            return False
        return all(self._watch.was_alive(job_id) for job_id in self._unfinished())

    def begin_attempt(self, job_id: str, attempt: int) -> bool:
        """Make attempt n ours; False when another worker was quicker."""
        try:
            self.attempt_folder(job_id, attempt).mkdir(mode=0o700)
        except FileExistsError:
            return False
        reached(Step.ATTEMPT_MADE)
        self.set_status(job_id, JobStatus(JobState.RUNNING, attempt))
        reached(Step.ATTEMPT_TOLD)
        return True

    def is_stale(self, job_id: str, status: JobStatus, lease_s: float) -> bool:
        """Return whether a running job's heartbeat has stood still for `lease_s`.

        The clock starts when this object first looks at the job.
        """
        heartbeat = status.attempt, status.heartbeat
        return self._watch.is_stale(job_id, heartbeat, lease_s)

    def status(self, job_id: str) -> JobStatus:
        """Read a job's status; QUEUED when nobody has taken it."""
        attempt = self._last_attempt(job_id)
        if not attempt:
            return JobStatus(JobState.QUEUED)
        path = self.attempt_folder(job_id, attempt) / "status.json"
        try:
            return msgspec.json.decode(path.read_bytes(), type=JobStatus)
        except FileNotFoundError:
            # Its worker has not said a word yet, and may have died before it could.
            return JobStatus(JobState.RUNNING, attempt)
        except (ValueError, RecursionError) as error:
            raise SpoolError(f"Status of job {job_id} is damaged: {error}.") from error

    def set_status(self, job_id: str, status: JobStatus) -> None:
        """Replace an attempt's status; only the worker whose attempt it is may."""
        folder = self.attempt_folder(job_id, status.attempt)
        record = msgspec.json.encode(status)
        # A heartbeat that a crash of the machine swallows is no loss.
        write_whole(folder / "status.json", record, lasting=status.state.is_final)

    def owns(self, job_id: str, attempt: int) -> bool:
        """Return whether attempt n is still the last one."""
        return self._last_attempt(job_id) == attempt

    def age_s(self, job_id: str) -> float:
        """Return seconds from a request's publication to the last sign of life.

        Both are times of files on one disk: it is the same clock on every machine.
        """
        said = self.attempt_folder(job_id) / "status.json"
        asked = self.job_folder(job_id) / "request.json"
        return (said.stat().st_mtime_ns - asked.stat().st_mtime_ns) * 1e-9

    def ask_cancel(self, job_id: str) -> None:
        """Ask for a job's end; harmless when it has ended."""
        self.job_folder(job_id).mkdir(mode=0o700, exist_ok=True)
        (self.job_folder(job_id) / "cancel").touch(mode=0o600)
        reached(Step.CANCEL_ASKED)

    def is_cancelled(self, job_id: str) -> bool:
        """Return whether the client asked for the job's end."""
        return (self.job_folder(job_id) / "cancel").exists()

    def ask_finish(self, job_id: str) -> None:
        """Ask for the best picture so far; harmless when the job has ended."""
        self.job_folder(job_id).mkdir(mode=0o700, exist_ok=True)
        (self.job_folder(job_id) / "finish").touch(mode=0o600)

    def is_enough(self, job_id: str) -> bool:
        """Return whether the client asked for the best picture so far."""
        return (self.job_folder(job_id) / "finish").exists()

    def result(self, job_id: str) -> SnapshotResult:
        """Read the result of a job that is DONE."""
        path = self.attempt_folder(job_id) / "result.json"
        try:
            return msgspec.json.decode(path.read_bytes(), type=SnapshotResult)
        except (OSError, ValueError, RecursionError) as error:
            raise SpoolError(
                f"Result of job {job_id} cannot be read: {error}."
            ) from error

    def _queued(self) -> list[Path]:
        """List the requests; what else lies there is nobody's job."""
        entries = []
        for path in self.queue.glob("[0-9]-*.json"):
            try:
                info = path.lstat()
            except FileNotFoundError:
                continue
            if stat.S_ISREG(info.st_mode) and is_job_id(path.stem[2:]):
                entries.append((path.name[0], info.st_mtime_ns, path))
        return [path for _, _, path in sorted(entries)]

    def _unfinished(self) -> list[str]:
        """List the jobs that were taken and are not known to have ended."""
        with os.scandir(self.jobs) as entries:
            listed = {
                (entry.name, entry.inode())
                for entry in entries
                # files of a desktop or of NFS are no jobs
                if is_job_id(entry.name) and entry.is_dir(follow_symlinks=False)
            }
        self._ended &= listed
        found = []
        for job in sorted(listed - self._ended):
            if self._status(job[0]).state.is_final:
                self._ended.add(job)
            elif (self.job_folder(job[0]) / "request.json").exists():
                found.append(job[0])
        self._watch.keep_only(found)
        return found

    def _status(self, job_id: str) -> JobStatus:
        """Read a status; a damaged one is that of an attempt which came to grief."""
        try:
            return self.status(job_id)
        except SpoolError:
            return JobStatus(JobState.RUNNING, self._last_attempt(job_id))

    def _last_attempt(self, job_id: str) -> int:
        try:
            names = os.listdir(self.job_folder(job_id))
        except (FileNotFoundError, NotADirectoryError):
            return 0
        numbers = (name[len(_ATTEMPT) :] for name in names if name.startswith(_ATTEMPT))
        return max((int(n) for n in numbers if n.isdecimal()), default=0)

    def _known(self, job_id: str) -> bytes | None:
        candidates = [self.job_folder(job_id) / "request.json"]
        candidates += self.queue.glob(f"[0-9]-{job_id}.json")
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
