from functools import partial
from pathlib import Path

import pytest

from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import (
    VARIABLE,
    Launcher,
    expect_company,
    find_launcher,
    launched_ranks,
    launcher_at,
)

SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "PMIX_SIZE", "SLURM_STEP_NUM_TASKS")


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*SIZES, VARIABLE, "MPI4PY_LIBMPI"):
        monkeypatch.delenv(name, raising=False)


def program(folder: Path, said: str) -> Path:
    path = folder / "mpiexec"
    path.write_text(f"#!/bin/sh\necho '{said}'\n")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(
    ("said", "is_open_mpi"),
    [
        ("HYDRA build details:", False),
        ("mpiexec (OpenRTE) 4.1.4", True),
        ("mpiexec (Open MPI) 5.0.3", True),
        ("prterun (PRRTE) 3.0.6", True),
    ],
)
def test_a_launcher_says_whose_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: str, is_open_mpi: bool
) -> None:
    path = program(tmp_path, said)
    monkeypatch.setenv(VARIABLE, str(path))
    assert find_launcher() == Launcher(str(path), is_open_mpi)
    monkeypatch.setenv(VARIABLE, "mpiexec")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert find_launcher() == Launcher(str(path), is_open_mpi)


def test_a_launcher_that_is_named_and_not_there_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "mpiexec"))
    with pytest.raises(TransportError, match=f"{VARIABLE} names .*, which is no"):
        find_launcher()
    broken = tmp_path / "mpiexec"
    broken.write_bytes(b"\x7fELF, not really")
    broken.chmod(0o755)
    with pytest.raises(TransportError, match=r"mpiexec cannot be run: "):
        launcher_at(str(broken))


def test_mpich_is_told_the_number_of_ranks_and_nothing_else() -> None:
    assert Launcher("/m", False).command(3, "-ppn", "2") == [
        *("/m", "-ppn", "2", "-n", "3")
    ]


@pytest.mark.parametrize("is_root", [True, False])
def test_open_mpi_is_told_what_mpich_does_unasked(
    monkeypatch: pytest.MonkeyPatch, is_root: bool
) -> None:
    monkeypatch.setattr("os.geteuid", partial(int, not is_root))
    words = Launcher("/m", True).command(7)
    assert words[0] == "/m"
    assert words[-2:] == ["-n", "7"]
    assert ("--allow-run-as-root" in words) == is_root
    assert "MPI4PY_LIBMPI=libmpi.so.40" in words
    monkeypatch.setenv("MPI4PY_LIBMPI", "libmpi_of_mine.so")
    assert "MPI4PY_LIBMPI" in Launcher("/m", True).command(7), "handed on as it is"


def test_ranks_that_do_not_find_each_other_are_told_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert launched_ranks() == 1
    expect_company(1)
    monkeypatch.setenv("SLURM_STEP_NUM_TASKS", "16")
    assert launched_ranks() == 16
    with pytest.raises(TransportError, match="one of 16, but MPI sees only itself"):
        expect_company(1)
    expect_company(16)
    # a launcher that Slurm runs once per machine knows better
    monkeypatch.setenv("PMI_SIZE", "1")
    expect_company(1)
