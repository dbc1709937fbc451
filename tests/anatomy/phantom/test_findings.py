import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.findings import is_healthy, told_findings, with_findings
from anatomy.phantom.parameters import Finding, Opacity, PhantomParameters

HEAD = PhantomParameters()


def test_words_become_findings_of_the_sides_they_name() -> None:
    words = ("fluid:maxillary:left=0.4,swelling:anterior-ethmoid=0.6", "polyps:right=2")
    head = with_findings(HEAD, [*words, "antrostomy:right=80", "congestion=0.5"])
    sizes = {(f.kind, f.sinus, f.side): f.size for f in head.findings}
    assert sizes == {
        ("fluid", "maxillary", "left"): 0.4,
        ("swelling", "anterior_ethmoid", "right"): 0.6,
        ("swelling", "anterior_ethmoid", "left"): 0.6,
    }
    assert head.opacity == (Opacity(polyps=2), Opacity())
    assert head.antrostomy_mm2 == (80.0, 0.0)
    assert head.congestion == 0.5
    assert not is_healthy(head)
    assert is_healthy(with_findings(HEAD, ["antrostomy=50", "posture=upright"]))


def test_a_later_word_takes_the_place_of_an_earlier_one() -> None:
    head = with_findings(HEAD, ["cyst:maxillary=5", "cyst:maxillary:left=9"])
    assert [(f.side, f.size) for f in head.findings] == [("right", 5), ("left", 9)]
    head = with_findings(HEAD, ["maxillary=2", "maxillary:left=0"])
    assert head.opacity == (Opacity(maxillary=2), Opacity())


@given(
    st.sampled_from(("fluid", "cyst", "swelling")),
    st.sampled_from(("maxillary", "sphenoid", "frontal")),
    st.sampled_from(("left", "right")),
    st.floats(0.0, 1.0),
    st.integers(0, 4),
)
def test_what_is_told_is_what_was_asked_for(
    kind: str, sinus: str, side: str, share: float, grade: int
) -> None:
    low, high = {"fluid": (0.05, 0.9), "cyst": (2, 14), "swelling": (0.2, 8)}[kind]
    size = float(np.round(low + share * (high - low), 3))
    words = [f"{kind}:{sinus}:{side}={size:g}"]
    words += [f"polyps:{side}={grade}"] if grade else []
    head = with_findings(HEAD, words)
    assert sorted(told_findings(head)) == sorted(words)
    assert with_findings(HEAD, told_findings(head)) == head


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("kidney=2", "disease reads NAME:SIDE=SCORE"),
        ("maxillary", "disease reads NAME:SIDE=SCORE"),
        ("fluid:maxillary", "disease reads"),
        ("maxillary=two", "whole number"),
        ("maxillary=\N{SUPERSCRIPT TWO}", "whole number"),
        ("maxillary:up=2", "left or right"),
        ("fluid:maxillary:up=0.4", "left or right"),
        ("ostiomeatal=1", "must be one of"),
        ("fluid:maxillary=full", "must be a number"),
        ("fluid:maxillary=nan", "must be a number"),
        ("fluid:maxillary=1.4", r"must lie in \[0.05, 0.9\]"),
        ("cyst:anterior-ethmoid=4", "cyst is found in maxillary"),
        ("swelling:posterior-ethmoid=4", r"must lie in \[0.2, 1.2\]"),
        ("antrostomy=5", "area of an antrostomy"),
        ("congestion=2", "congestion must lie in"),
        ("posture=prone", "supine or upright"),
    ],
)
def test_what_cannot_be_is_one_sentence(word: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        with_findings(HEAD, [word])


def test_a_finding_is_named_once() -> None:
    twice = Finding(kind="cyst", sinus="maxillary", side="left", size=5.0)
    with pytest.raises(ValueError, match="once for each sinus"):
        PhantomParameters(findings=(twice, twice))
