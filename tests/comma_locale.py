"""A country where the decimal is a comma, on a machine that may not know it."""

import locale
import os
import shutil
import subprocess
from collections.abc import Iterator

import pytest

GERMAN = "de_DE.UTF-8"


@pytest.fixture(scope="session")
def germany(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What a German's environment holds more, and names in place of others.

    The locale is made where no other program sees it; Debian's package `locales` has
    what it is made of.
    """
    maker = shutil.which("localedef")
    if maker is None:
        pytest.skip("there is no localedef")
    folder = tmp_path_factory.mktemp("locales")
    # it says 1 where it only warns of something
    subprocess.run(
        [maker, "-i", "de_DE", "-f", "UTF-8", folder / GERMAN], capture_output=True
    )
    if not (folder / GERMAN / "LC_NUMERIC").is_file():
        pytest.skip("this machine cannot make a German locale; install locales")
    return {"LOCPATH": str(folder), "LANG": GERMAN, "LC_ALL": "", "LC_NUMERIC": ""}


@pytest.fixture
def comma(germany: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A comma in this process, as a program that we are a library of may set it."""
    for name, value in germany.items():
        monkeypatch.setenv(name, value)
    before = locale.setlocale(locale.LC_NUMERIC)
    locale.setlocale(locale.LC_NUMERIC, GERMAN)
    assert locale.localeconv()["decimal_point"] == ","
    yield
    locale.setlocale(locale.LC_NUMERIC, before)


def abroad(germany: dict[str, str]) -> dict[str, str]:
    """Return the environment of a child that is started there."""
    return os.environ | germany
