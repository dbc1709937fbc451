import random

import pytest

from devices.microscribe.emulator.faults.catalogue import (
    FAULTS,
    SHORT_NAMES,
    TruncatedReply,
    list_faults,
    make_faults,
    parse_fault,
)
from devices.microscribe.emulator.faults.fault import Fault
from devices.microscribe.emulator.faults.schedule import Schedule
from tests.devices.microscribe.rare_faults import EVERY_FAULT, parse_any_fault


def test_there_are_thirty_numbered_faults_and_one_more() -> None:
    ids = {kind.id for kind in EVERY_FAULT}
    assert ids == {"garbage", *(f"f{n}" for n in range(1, 31))}
    assert len({kind.word for kind in EVERY_FAULT}) == len(EVERY_FAULT) == 31


def test_the_product_has_those_that_hardware_shows() -> None:
    assert 10 <= len(FAULTS) <= 12
    assert set(FAULTS) < set(EVERY_FAULT)
    with pytest.raises(ValueError, match="not known"):
        parse_fault("f29_memory_write")


@pytest.mark.parametrize("kind", EVERY_FAULT)
def test_number_word_and_both_name_the_same_fault(kind: type[Fault]) -> None:
    names = {kind.name(), kind.word, kind.id}
    for name in names:
        plan = parse_any_fault(f"{name.upper()}@2.5+1" if kind.id != "f22" else name)
        assert plan.kind is kind
    for variant in kind.variants:
        fault = parse_any_fault(f"{kind.word}={variant.lower()}").make(random.Random(0))
        assert fault.variant == variant


def test_the_list_has_a_line_for_every_name() -> None:
    lines = list_faults()
    assert [*lines] == [*(kind.name() for kind in FAULTS), *SHORT_NAMES]
    assert all(len(line) < 90 and len(line.split()) > 2 for line in lines.values())


def test_short_names() -> None:
    plan = parse_fault("unplug@packet:3")
    assert (plan.kind, plan.variant) == (TruncatedReply, "UNPLUG")
    assert plan.schedule == Schedule(packet=3)
    assert parse_fault("replug").variant == "REPLUG"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("droped_byte@1", "nearest is 'dropped_byte'"),
        ("f31@1", "nearest is 'f3"),
        ("qqqq", r"'qqqq' is not known \(--list-faults"),
        ("", "is not known"),
        ("f8@", "must be NAME"),
        ("f8=@1", "must be NAME"),
        ("f8@soon", "moment of a fault must be"),
        ("f6=nobody@0", "takes IBOX, XXXX, EMPTY after =, got 'NOBODY'"),
        ("f1=3", "takes nothing after ="),
        ("f8=x", "takes a number"),
        ("f3=21", "1 to 20"),
        ("f22=odd@3", "without a moment"),
        ("f27=dead9", "takes DEAD2"),
    ],
)
def test_mistakes_are_told_with_the_remedy(text: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        parse_any_fault(text)


def test_faults_of_the_wire_act_on_what_the_others_left() -> None:
    plans = [parse_any_fault(name) for name in ("unplug", "f13", "f30", "f8", "f12")]
    names = [fault.id for fault in make_faults(plans, 0)]
    assert names == ["f8", "f12", "f30", "f13", "f16"]


def test_each_fault_has_chances_of_its_own() -> None:
    plans = [parse_any_fault("f8@p:.5"), parse_any_fault("f8@p:.5")]
    first, second = make_faults(plans, 1)
    again, _ = make_faults(plans, 1)
    draws = [f.noise.random() for f in (first, second, again)]
    assert draws[0] == draws[2] != draws[1]
