"""What a spool folder no longer needs is taken out of it."""

import math
import os
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from renderers.art.job_steps import Step, reached
from renderers.snapshots.data_store import HIDDEN
from renderers.snapshots.request import is_job_id
from renderers.snapshots.spool import Spool
from system import UserError

KEEP_S = 7 * 86_400.0
"""How long a finished job is kept for its client."""

GRACE_S = 3_600.0
"""How long anything that nobody names is left alone: a client stores arrays before it
publishes the request that names them."""

PRUNE_EVERY_S = 60.0

_DIGEST = re.compile(rb"[0-9a-f]{64}")


class Pruner:
    """Remove finished jobs, arrays that no job names, and files never finished."""

    def __init__(
        self, spool: Spool, keep_s: float = KEEP_S, grace_s: float = GRACE_S
    ) -> None:
        """Take the times of a file's life; the disk's clock counts, not ours."""
        if not (keep_s >= 0 and grace_s >= 0):
            raise UserError(f"times to keep files are not negative: {keep_s, grace_s}")
        self._spool = spool
        self._keep_s = keep_s
        self._grace_s = grace_s
        self._last_s = -PRUNE_EVERY_S

    def prune_at_times(self) -> None:
        """Prune, unless that was done a moment ago."""
        now = time.monotonic()
        if now - self._last_s >= PRUNE_EVERY_S:
            self._last_s = now
            self.prune()

    def prune(self) -> None:
        """Remove what has had its time. Several workers may do so at once."""
        now = self._now_s()
        for folder in self._folders():
            hidden = folder.name.startswith(HIDDEN)
            if hidden or self._is_spent(folder, now):
                _remove(folder)
        # Listed before the requests are read: what is stored later is not looked at.
        unnamed_s = max(self._grace_s, self._keep_s)
        stored = [
            path
            for path in (self._spool.folder / "data").iterdir()
            if _age_s(path, now) > unnamed_s
        ]
        named = self._named()
        for path in stored:
            if path.name.startswith(HIDDEN):
                path.unlink(missing_ok=True)
            elif path.name not in named and _DIGEST.fullmatch(path.name.encode()):
                self._remove_array(path, now)
        for path in self._spool.queue.glob(f"{HIDDEN}*"):
            if _age_s(path, now) > self._grace_s:
                path.unlink(missing_ok=True)

    def _now_s(self) -> float:
        probe = self._spool.folder / f"{HIDDEN}now-{os.getpid()}"
        probe.touch(mode=0o600)
        try:
            return probe.stat().st_mtime
        finally:
            probe.unlink(missing_ok=True)

    def _folders(self) -> Iterator[Path]:
        with os.scandir(self._spool.jobs) as entries:
            names = [entry.name for entry in entries]
        ours = (n for n in names if n.startswith(HIDDEN) or is_job_id(n))
        return (self._spool.jobs / name for name in ours)

    def _is_spent(self, folder: Path, now: float) -> bool:
        job_id = folder.name
        try:
            if (folder / "request.json").exists():
                status = self._spool.attempt_folder(job_id) / "status.json"
                return (
                    _age_s(status, now) >= self._keep_s
                    and self._spool.status(job_id).state.is_final
                )
        except (OSError, RuntimeError):
            # Not begun, damaged or being removed: not ours to judge.
            return False
        # A wish to cancel what nobody ever asked for, or what was pruned.
        queued = any(self._spool.queue.glob(f"[0-9]-{job_id}.json"))
        return not queued and _age_s(folder, now) > max(self._keep_s, self._grace_s)

    def _named(self) -> set[str]:
        """Find the digests that any request names, without asking it to be valid."""
        named: set[str] = set()
        requests = [*self._spool.queue.glob("*.json")]
        requests += [folder / "request.json" for folder in self._folders()]
        for path in requests:
            try:
                found = _DIGEST.findall(path.read_bytes())
            except OSError:
                continue
            named.update(digest.decode() for digest in found)
        return named

    def _remove_array(self, path: Path, now: float) -> None:
        aside = path.with_name(f"{HIDDEN}{path.name}")
        try:
            path.rename(aside)
            if _age_s(aside, now) > max(self._grace_s, self._keep_s):
                aside.unlink()
            else:
                # A client came between and counts on it.
                aside.rename(path)
        except FileNotFoundError:
            return


def _age_s(path: Path, now: float) -> float:
    """Return a file's age; less than any limit where another pruner was quicker."""
    try:
        return now - path.stat().st_mtime
    except FileNotFoundError:
        return -math.inf


def _remove(folder: Path) -> None:
    """Let a job vanish at once, then remove its files; another may be doing so."""
    hidden = folder
    if not folder.name.startswith(HIDDEN):
        hidden = folder.with_name(f"{HIDDEN}{folder.name}")
        try:
            folder.rename(hidden)
        except OSError:
            return
        reached(Step.JOB_HIDDEN)
    shutil.rmtree(hidden, ignore_errors=True)
