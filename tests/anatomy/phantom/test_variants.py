import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal, norm

from anatomy.phantom.ethmoid import lamina_papyracea
from anatomy.phantom.parameters import (
    SIDED_VARIANTS,
    SPHENOID_KINDS,
    Finding,
    Opacity,
    PhantomParameters,
)
from anatomy.phantom.variants import (
    NAMES,
    PREVALENCE,
    SIDE_CORRELATION,
    draw_variants,
    is_healthy,
    kind_slice,
    told_findings,
    variant_names,
    with_findings,
    with_variants,
    without_variants,
)
from anatomy.tissue import Side

DEFAULT = PhantomParameters()


def test_a_variant_is_added_to_the_side_asked_for() -> None:
    head = with_variants(DEFAULT, ["onodi:left"])
    assert head.has("onodi", Side.LEFT)
    assert not head.has("onodi", Side.RIGHT)
    assert head.has("agger-nasi", Side.RIGHT)


def test_without_a_side_both_get_it_and_removal_undoes_it() -> None:
    head = with_variants(DEFAULT, ["haller"])
    assert all(head.has("haller", side) for side in (Side.LEFT, Side.RIGHT))
    assert without_variants(head, ["haller"]) == DEFAULT


def test_keros_septum_and_sizes_can_be_asked_for_by_name() -> None:
    head = with_variants(
        DEFAULT, ["keros-3", "septal-deviation:left", "hypoplastic-maxillary:left"]
    )
    assert head.keros_mm > 7
    assert head.septal_deviation_mm < 0
    assert head.scale("maxillary", Side.LEFT) == pytest.approx(0.64)
    assert head.scale("maxillary", Side.RIGHT) == DEFAULT.maxillary_scale
    bare = with_variants(DEFAULT, ["frontal-aplasia:left"])
    assert bare.scale("frontal", Side.LEFT) == 0.0
    assert bare.scale("frontal", Side.RIGHT) == 1.0


@pytest.mark.parametrize("name", NAMES)
def test_what_was_asked_for_is_named(name: str) -> None:
    """And asking for all that is named changes nothing."""
    side = "" if name.startswith("keros") else ":left"
    head = with_variants(DEFAULT, [name + side])
    named = variant_names(head)
    assert name + side in named
    assert len([word for word in named if word.startswith("keros")]) == 1
    again = with_variants(head, named)
    assert variant_names(again) == named
    assert again.variants == head.variants


@pytest.mark.parametrize(("mm", "kind"), [(1, 1), (3, 1), (4, 2), (7, 2), (8, 3)])
def test_keros_types_are_millimetres(mm: float, kind: int) -> None:
    head = msgspec.structs.replace(DEFAULT, keros_mm=float(mm))
    assert variant_names(head)[-1] == f"keros-{kind}"


def test_olfactory_fossae_may_differ_by_side() -> None:
    head = with_variants(DEFAULT, ["keros-1:left"])
    assert head.keros(Side.RIGHT) == DEFAULT.keros_mm
    assert head.keros(Side.LEFT) == pytest.approx(2.4)
    assert variant_names(head)[-2:] == ("keros-2:right", "keros-1:left")
    assert with_variants(head, ["keros-2:left"]) == DEFAULT


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("onodo", "there is no variant .*did you mean .onodi"),
        ("onodi:up", "must be left or right"),
        ("frontal-aplasia:right", "cannot be built"),
    ],
)
def test_what_there_is_not_is_refused(name: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        with_variants(DEFAULT, [name])


def test_prevalences_and_side_correlation_are_those_published() -> None:
    """What is there or not is a slice of two normal variables correlated by 0.6."""
    rng = np.random.default_rng(0)
    count = 6000
    drawn = [draw_variants(rng) for _ in range(count)]
    hidden = multivariate_normal([0, 0], [[1, SIDE_CORRELATION], [SIDE_CORRELATION, 1]])
    for name, share in PREVALENCE.items():
        left = np.array([f"{name}:left" in v for v in drawn])
        right = np.array([f"{name}:right" in v for v in drawn])
        low, high = kind_slice(name) if name in SPHENOID_KINDS else (0.0, share)
        edges = norm.ppf([max(low, 1e-12), min(high, 1 - 1e-12)])
        both = sum(
            sign * hidden.cdf([edges[i], edges[j]])
            for i, j, sign in ((1, 1, 1), (0, 1, -1), (1, 0, -1), (0, 0, 1))
        )
        for found, expected in ((left, share), (right, share), (left & right, both)):
            error = np.sqrt(expected * (1 - expected) / count)
            # a conchal sinus takes its recess away
            gone = 0.02 if name == "lateral-recess" else 0.0
            assert abs(found.mean() - expected) <= 3.5 * error + gone, name
    assert set(PREVALENCE) == set(SIDED_VARIANTS) <= set(NAMES)


def test_a_side_has_one_kind_of_sphenoid() -> None:
    head = with_variants(DEFAULT, ["conchal-sphenoid", "postsellar-sphenoid:left"])
    assert not head.has("conchal-sphenoid", Side.LEFT)
    assert head.has("postsellar-sphenoid", Side.LEFT)
    assert head.has("conchal-sphenoid", Side.RIGHT)
    recessed = with_variants(head, ["lateral-recess"])
    assert not recessed.has("conchal-sphenoid", Side.RIGHT)
    assert recessed.has("postsellar-sphenoid", Side.LEFT)
    rng = np.random.default_rng(1)
    for _ in range(500):
        msgspec.structs.replace(DEFAULT, variants=draw_variants(rng))
    with pytest.raises(ValueError, match=r"exclude each other.*the left side"):
        PhantomParameters(
            variants=("conchal-sphenoid:left", "postsellar-sphenoid:left")
        )


def test_a_wider_ethmoid_moves_the_lamina_on_its_side_alone() -> None:
    head = PhantomParameters(ethmoid_scale=1.2)
    point = np.array([[0.0], [-30.0], [38.0]])
    wide = lamina_papyracea(head, Side.RIGHT).evaluate(point)
    plain = lamina_papyracea(DEFAULT, Side.RIGHT).evaluate(point)
    assert wide[0] > plain[0] + 1.0


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
