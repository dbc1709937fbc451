"""The cases that somebody flew through."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.case import SCHEMA_VERSION, CaseRecord
from anatomy.phantom.parameters import PhantomParameters
from paravol.trainee.cases import MOST, add_case, case_at, known_cases
from scenarios.bundle import write_json
from system import UserError


def make_case(folder: Path) -> Path:
    """Write the description of a case; volumes are not looked at."""
    folder.mkdir(parents=True)
    record = CaseRecord(
        schema_version=SCHEMA_VERSION,
        spacing_mm=0.5,
        parameters=PhantomParameters(seed=7),
        sha256={},
    )
    write_json(folder / "case.json", record)
    return folder


def test_a_case_that_is_gone_or_damaged_is_left_out(tmp_path: Path) -> None:
    first, second = make_case(tmp_path / "a" / "one"), make_case(tmp_path / "b" / "two")
    third = make_case(tmp_path / "cases" / "three")
    (second / "case.json").write_text("no json")
    remembered = [str(first), str(second), str(tmp_path / "gone"), str(third)]
    found = known_cases(remembered, tmp_path / "cases")
    assert [case.folder for case in found] == [first, third]
    assert [case.title for case in found] == ["one", "three"]
    assert {case.about for case in found} == {"A phantom, seed 7"}


@pytest.mark.parametrize("content", [None, "no json", "[]"])
def test_what_is_no_case_is_refused_with_its_name(
    tmp_path: Path, content: str | None
) -> None:
    if content is not None:
        (tmp_path / "case.json").write_text(content)
    with pytest.raises(UserError, match=tmp_path.name):
        case_at(tmp_path)


@given(st.lists(st.sampled_from([f"/cases/{n}" for n in range(30)]), max_size=40))
def test_the_newest_comes_first_once(opened: list[str]) -> None:
    remembered: tuple[str, ...] = ()
    for name in opened:
        remembered = add_case(remembered, Path(name))
    newest_first = list(dict.fromkeys(reversed(opened)))
    assert list(remembered) == newest_first[:MOST]
