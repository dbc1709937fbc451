import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from system.csv_table import CsvTable
from system.plain_text import plain

BEGINNINGS = ("=", "+", "-", "@", "\t", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def told(*row: object) -> list[str]:
    text = io.StringIO()
    CsvTable(text).add(row)
    (read,) = csv.reader(io.StringIO(text.getvalue(), newline=""))
    return read


@pytest.mark.parametrize("begin", BEGINNINGS)
def test_no_text_begins_as_a_formula_does(begin: str) -> None:
    name = f"{begin}cmd|' /C calc'!A0"
    assert told(name, "a") == [f"'{name}", "a"]


@given(st.floats())
def test_numbers_stay_numbers(number: float) -> None:
    assert told(number, repr(number), str(number)) == [repr(number)] * 3


@given(st.text())
def test_a_text_comes_back_whole(text: str) -> None:
    (read,) = told(text)
    assert read in (plain(text), f"'{plain(text)}")
    if read.startswith(BEGINNINGS):
        # nothing but a number
        float(read)
