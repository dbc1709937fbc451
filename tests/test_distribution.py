"""The wheel holds all that the program needs, and nothing else stands beside it."""

import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from paravol.checks.machine_check import OUR_PACKAGES

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
EXAMPLES = ("first_flight", "first_operation")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the wheel as a build front end would, without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
    subprocess.run([*command, "-d", str(folder)], cwd=ROOT, check=True, timeout=120)
    (made,) = folder.glob("*.whl")
    return made


def tracked_files() -> set[str]:
    """Return the files below our packages that git knows, without caches."""
    command = ["git", "ls-files", "--", *OUR_PACKAGES]
    told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return {name for name in told.stdout.splitlines() if (ROOT / name).exists()}


def test_the_wheel_holds_every_file_of_our_packages_and_the_examples(
    wheel: Path,
) -> None:
    names = {n for n in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in n}
    examples = {
        f"scenarios/examples/{name}.{kind}"
        for name in EXAMPLES
        for kind in ("toml", "path.json")
    }
    assert names == tracked_files() | examples


@pytest.mark.slow
def test_the_source_distribution_makes_the_same_wheel(
    wheel: Path, tmp_path: Path
) -> None:
    build = [sys.executable, "-m", "hatchling", "build"]
    made, unpacked = tmp_path / "made", tmp_path / "unpacked"
    subprocess.run(
        [*build, "-t", "sdist", "-d", str(made)], cwd=ROOT, check=True, timeout=120
    )
    (source,) = made.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        archive.extractall(unpacked, filter="data")
    (tree,) = unpacked.iterdir()
    subprocess.run(
        [*build, "-t", "wheel", "-d", str(made)], cwd=tree, check=True, timeout=120
    )
    (again,) = made.glob("*.whl")
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(again) as other:
        assert one.namelist() == other.namelist()
        for name in one.namelist():
            assert one.read(name) == other.read(name), name


def test_the_wheel_brings_these_top_level_packages_only(wheel: Path) -> None:
    tops = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    version = PROJECT["project"]["version"]
    assert tops == {*OUR_PACKAGES, f"paravol_ess-{version}.dist-info"}


def test_the_unpacked_wheel_finds_all_exercises_from_anywhere(
    wheel: Path, tmp_path: Path
) -> None:
    place, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    zipfile.ZipFile(wheel).extractall(place)
    elsewhere.mkdir()
    code = (
        "import scenarios.scenario as s; print(s.__file__);"
        "print(*sorted(s.bundled_scenarios()));"
        "print(s.load_scenario('first_flight')[0].title)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code],
        cwd=elsewhere,
        env=os.environ | {"PYTHONPATH": str(place)},
        check=True,
        capture_output=True,
        text=True,
    ).stdout.splitlines()
    assert told[0].startswith(str(place))
    here = {file.stem for file in (ROOT / "scenarios" / "curriculum").glob("*.toml")}
    assert set(told[1].split()) == here | set(EXAMPLES)


def test_the_citation_names_the_version_of_the_project() -> None:
    citation = (ROOT / "CITATION.cff").read_text().splitlines()
    assert f"version: {PROJECT['project']['version']}" in citation
