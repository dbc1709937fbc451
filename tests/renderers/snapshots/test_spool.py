import os
import threading
from pathlib import Path

import msgspec
import pytest

from renderers.snapshots.spool import JobState, JobStatus, Spool, SpoolError
from tests.renderers.snapshots.bare_requests import bare_request


@pytest.fixture
def now() -> list[float]:
    """Hold the time a spool goes by."""
    return [100.0]


@pytest.fixture
def spool(tmp_path: Path, now: list[float]) -> Spool:
    return Spool(tmp_path / "spool", lambda: now[0])


def test_a_request_is_claimed_once(spool: Spool) -> None:
    request = bare_request(1)
    spool.publish(request)
    claimed = spool.claim()
    assert claimed == (request.id, msgspec.json.encode(request), 1)
    assert spool.status(request.id) == JobStatus(JobState.RUNNING, 1)
    assert spool.claim() is None
    assert spool.owns(request.id, 1)


def test_urgent_before_early_before_late(spool: Spool) -> None:
    for number, priority in ((3, 5), (1, 5), (2, 0)):
        spool.publish(bare_request(number, priority=priority))
        path = next((spool.folder / "queue").glob(f"*{number:032x}*"))
        os.utime(path, ns=(0, 10**9 * (1 if number == 3 else 2)))
    order = []
    while (claimed := spool.claim()) is not None:
        order.append(int(claimed[0], 16))
    assert order == [2, 3, 1]


def test_of_two_claimers_one_wins(spool: Spool) -> None:
    for number in range(20):
        spool.publish(bare_request(number))
    won: list[list[str]] = [[], [], []]
    start = threading.Barrier(3)

    def claim(mine: list[str]) -> None:
        own = Spool(spool.folder)
        start.wait()
        while (claimed := own.claim()) is not None:
            mine.append(claimed[0])

    threads = [threading.Thread(target=claim, args=(mine,)) for mine in won]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(job for mine in won for job in mine) == [
        f"{n:032x}" for n in range(20)
    ]


def test_a_claimer_leaves_what_another_is_claiming(
    spool: Spool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second comes between the first one's link and its look at the count."""
    spool.publish(bare_request(1))
    other = Spool(spool.folder)
    link = os.link

    def link_then_let_the_other_try(source: Path, target: Path) -> None:
        link(source, target)
        monkeypatch.setattr(os, "link", link)
        assert other.claim() is None

    monkeypatch.setattr(os, "link", link_then_let_the_other_try)
    claimed = spool.claim()
    assert claimed is not None
    assert claimed[0] == f"{1:032x}"
    assert other.claim() is None


def test_publishing_again_changes_nothing(spool: Spool) -> None:
    request = bare_request(1)
    spool.publish(request)
    spool.publish(request)
    assert len(list((spool.folder / "queue").iterdir())) == 1
    spool.claim()
    spool.publish(request)
    assert spool.claim() is None
    with pytest.raises(SpoolError, match="already asks for something else"):
        spool.publish(bare_request(1, priority=3))


def test_a_silent_worker_is_replaced_once(spool: Spool, now: list[float]) -> None:
    request = bare_request(1)
    spool.publish(request)
    spool.claim()
    others = [Spool(spool.folder, lambda: now[0]) for _ in range(2)]
    for _ in range(3):
        # A heart that beats keeps the lease, whatever the clocks show.
        now[0] += 10
        beat = int(now[0])
        spool.set_status(request.id, JobStatus(JobState.RUNNING, 1, beat))
        assert all(other.take_over(15) is None for other in others)
    now[0] += 16
    taken = [other.take_over(15) for other in others]
    assert taken[0] == (request.id, msgspec.json.encode(request), 2)
    assert taken[1] is None
    assert not spool.owns(request.id, 1)
    assert spool.owns(request.id, 2)


def test_a_claimer_that_died_before_its_first_word_is_replaced(
    spool: Spool, now: list[float]
) -> None:
    request = bare_request(1)
    spool.publish(request)
    entry = next((spool.folder / "queue").iterdir())
    folder = spool.job_folder(request.id)
    folder.mkdir()
    os.link(entry, folder / "request.json")
    assert spool.claim() is None
    assert spool.take_over(15) is None
    now[0] += 16
    taken = spool.take_over(15)
    assert not list((spool.folder / "queue").iterdir())
    assert taken is not None
    assert taken[2] == 1


def test_a_request_longer_than_allowed_is_read_no_further(spool: Spool) -> None:
    path = spool.folder / "queue" / f"5-{7:032x}.json"
    path.write_bytes(b"x" * 2_000_000)
    claimed = spool.claim()
    assert claimed is not None
    assert len(claimed[1]) == 256 * 1024 + 1


def test_folders_that_cannot_serve_are_refused_in_one_sentence(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for folder in (file, file / "below"):
        with pytest.raises(SpoolError, match=r"^Spool \S+ cannot be used: .*\.$"):
            Spool(folder)
    shared = tmp_path / "shared"
    shared.mkdir(mode=0o755)
    (shared / "something").touch()
    with pytest.raises(SpoolError, match="open to other users; run chmod 700"):
        Spool(shared)
    with pytest.raises(SpoolError, match="cannot be used"):
        Spool(Path("/proc/spool"))


def test_a_folder_of_ones_own_is_closed_to_others(tmp_path: Path) -> None:
    open_folder = tmp_path / "mine"
    open_folder.mkdir(mode=0o755)
    for folder in (open_folder, tmp_path / "new"):
        spool = Spool(folder)
        for path in (folder, *folder.iterdir()):
            assert path.stat().st_mode & 0o077 == 0
        assert spool.claim() is None


def test_what_no_worker_would_accept_is_not_published(spool: Spool) -> None:
    wrong = msgspec.structs.replace(bare_request(1), priority=11)
    with pytest.raises(ValueError, match="priority must be a whole number, at most 9"):
        spool.publish(wrong)
    large = msgspec.structs.replace(bare_request(1), client="x" * 300_000)
    with pytest.raises(ValueError, match="at most 262144 bytes"):
        spool.publish(large)
    assert not list(spool.queue.iterdir())


def test_a_damaged_status_stops_nobody_else(spool: Spool, now: list[float]) -> None:
    for number in (1, 2):
        spool.publish(bare_request(number))
        assert spool.claim() is not None
    (spool.attempt_folder(f"{1:032x}") / "status.json").write_bytes(b"odd")
    with pytest.raises(SpoolError, match="is damaged"):
        spool.status(f"{1:032x}")
    assert spool.take_over(15) is None
    now[0] += 16
    taken = [spool.take_over(15), spool.take_over(15)]
    assert [(t.job_id, t.attempt) for t in taken if t is not None] == [
        (f"{1:032x}", 2),
        (f"{2:032x}", 2),
    ]


def test_it_is_quiet_when_all_that_is_left_has_a_living_worker(
    spool: Spool, now: list[float]
) -> None:
    assert spool.is_quiet()
    request = bare_request(1)
    spool.publish(request)
    assert not spool.is_quiet()
    other = Spool(spool.folder, lambda: now[0])
    assert other.claim() is not None
    # Nobody knows yet whether that worker still lives.
    for _ in range(2):
        assert spool.take_over(15) is None
        assert not spool.is_quiet()
        now[0] += 5
    other.set_status(request.id, JobStatus(JobState.RUNNING, 1, 1))
    assert spool.take_over(15) is None
    assert spool.is_quiet()
    other.set_status(request.id, JobStatus(JobState.DONE, 1, 2))
    fresh = Spool(spool.folder, lambda: now[0])
    assert fresh.take_over(15) is None
    assert fresh.is_quiet()


def test_the_age_of_a_request_is_by_the_disks_clock(spool: Spool) -> None:
    spool.publish(bare_request(1))
    entry = next(spool.queue.iterdir())
    asked = entry.stat().st_mtime - 90
    os.utime(entry, (asked, asked))
    claim = spool.claim()
    assert claim is not None
    assert 90 <= spool.age_s(claim.job_id) < 120


def test_jobs_that_ended_are_not_read_again(
    spool: Spool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else an idle worker's time would grow with what it has ever done."""
    for number, state in enumerate(filter(lambda s: s.is_final, JobState)):
        spool.publish(bare_request(number))
        claim = spool.claim()
        assert claim is not None
        spool.set_status(claim.job_id, JobStatus(state, 1))
    assert spool.take_over(15) is None
    looks: list[str] = []
    status = Spool.status

    def counted(self: Spool, job_id: str) -> JobStatus:
        looks.append(job_id)
        return status(self, job_id)

    monkeypatch.setattr(Spool, "status", counted)
    assert spool.take_over(15) is None
    assert not looks
    spool.publish(bare_request(9))
    assert spool.claim() is not None
    assert spool.take_over(15) is None
    assert set(looks) == {f"{9:032x}"}


@pytest.mark.parametrize(
    "name", [".DS_Store", ".nfs0000001", "Thumbs.db", "README", "a" * 31, "A" * 32]
)
@pytest.mark.parametrize("is_folder", [False, True])
def test_strangers_among_jobs_are_no_jobs(
    spool: Spool, now: list[float], name: str, is_folder: bool
) -> None:
    """Desktops, NFS and people leave things in any folder."""
    for place in (
        spool.jobs / name,
        spool.queue / name,
        spool.queue / f"5-{name}.json",
    ):
        if is_folder:
            place.mkdir()
        else:
            place.write_bytes(b"x")
    assert spool.claim() is None
    assert spool.take_over(0.0) is None
    now[0] += 100.0
    assert spool.take_over(0.0) is None
    assert spool.is_quiet()
    spool.publish(bare_request(1))
    claim = spool.claim()
    assert claim is not None
    assert (spool.jobs / name).exists()


@pytest.mark.parametrize("name", ["5-.json", "5-...json", "5-..json", "5-a b.json"])
def test_a_name_in_the_queue_leads_nowhere_else(spool: Spool, name: str) -> None:
    """The name becomes that of a job's folder."""
    (spool.queue / name).write_bytes(b"{}")
    before = sorted(spool.folder.rglob("*"))
    assert spool.claim() is None
    assert sorted(spool.folder.rglob("*")) == before


def test_a_link_in_the_queue_is_no_request(spool: Spool, tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(b"secret")
    (spool.queue / f"5-{'a' * 32}.json").symlink_to(tmp_path / "secret")
    assert spool.claim() is None
