"""Statements keep the rules of xAPI 1.0.3."""

import datetime
import json
import re
import uuid
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.progress.xapi import HOME_PAGE, iso_duration, statements
from system import UserError
from tests.paravol.progress.learners import ENTRIES, entry

IRI = re.compile(r"https?://[^\s<>\"{}|\\^`/]+(/[^\s<>\"{}|\\^`]*)?")
DURATION = re.compile(r"P(?=.)(\d+D)?(T(?=.)(\d+H)?(\d+M)?(\d+(\.\d+)?S)?)?")
LANGUAGE = re.compile(r"[a-z]{2,3}(-[A-Z]{2})?")

FIELDS = {
    "": "id actor verb object result context timestamp stored authority version "
    "attachments",
    "actor": "objectType name mbox mbox_sha1sum openid account",
    "account": "homePage name",
    "verb": "id display",
    "object": "objectType id definition",
    "definition": "name description type moreInfo extensions",
    "result": "score success completion response duration extensions",
    "score": "scaled raw min max",
    "context": "registration instructor team contextActivities revision platform "
    "language statement extensions",
}
"""Every field that xAPI 1.0.3 knows of these objects; no other may be there."""


def check(statement: dict[str, Any]) -> None:
    """Fail unless a statement keeps the rules of xAPI-Data.md, sections 2.2 to 4."""
    known("", statement)
    assert {"actor", "verb", "object"} <= set(statement)
    assert uuid.UUID(statement["id"]).version
    assert statement["version"].startswith("1.0.")
    when = datetime.datetime.fromisoformat(statement["timestamp"])
    assert when.tzinfo is not None
    actor = statement["actor"]
    known("actor", actor)
    assert actor["objectType"] == "Agent"
    # exactly one inverse functional identifier
    assert len({"mbox", "mbox_sha1sum", "openid", "account"} & set(actor)) == 1
    known("account", actor["account"])
    assert IRI.fullmatch(actor["account"]["homePage"])
    assert isinstance(actor["account"]["name"], str)
    assert actor["account"]["name"]
    known("verb", statement["verb"])
    assert IRI.fullmatch(statement["verb"]["id"])
    language_map(statement["verb"]["display"])
    known("object", statement["object"])
    assert statement["object"]["objectType"] == "Activity"
    assert IRI.fullmatch(statement["object"]["id"])
    known("definition", statement["object"]["definition"])
    assert IRI.fullmatch(statement["object"]["definition"]["type"])
    language_map(statement["object"]["definition"]["name"])
    known("context", statement["context"])
    result = statement["result"]
    known("result", result)
    assert DURATION.fullmatch(result["duration"])
    assert all(isinstance(result.get(k, True), bool) for k in ("success", "completion"))
    assert all(IRI.fullmatch(key) for key in result["extensions"])
    if "score" in result:
        score = result["score"]
        known("score", score)
        assert -1 <= score["scaled"] <= 1
        assert score["min"] < score["max"]
        assert score["min"] <= score["raw"] <= score["max"]
    # nothing may be null, outside of extensions and in them
    assert "null" not in json.dumps(statement, allow_nan=False)


def known(name: str, told: dict[str, Any]) -> None:
    assert set(told) <= set(FIELDS[name].split()), name


def language_map(told: dict[str, str]) -> None:
    assert told
    assert all(LANGUAGE.fullmatch(k) and isinstance(v, str) for k, v in told.items())


@pytest.mark.parametrize("base", [HOME_PAGE, "https://skills.example.org/ent/"])
def test_statements_keep_the_rules_of_xapi(base: str) -> None:
    told = statements(ENTRIES, base)
    for statement in told:
        check(statement)
        assert statement["actor"]["account"]["homePage"] == base.rstrip("/")
        assert set(statement["actor"]) == {"objectType", "account"}
    verbs = [s["verb"]["id"].rpartition("/") for s in told]
    assert {v[0] for v in verbs} == {"http://adlnet.gov/expapi/verbs"}
    assert [v[2] for v in verbs] == ["completed", "passed", "failed"]
    assert [s["result"].get("success") for s in told] == [None, True, False]
    *named, unnamed = (s["actor"]["account"]["name"] for s in told)
    assert named == ["ann", "ann"]
    # two sessions without a name may be two people's
    assert unnamed.startswith("unnamed-")
    (other,) = statements([entry("", 4)], base)
    assert other["actor"]["account"]["name"] != unnamed
    score = told[1]["result"]["score"]
    assert score == {"scaled": 0.815, "raw": 81.5, "min": 0, "max": 100}
    assert "score" not in told[0]["result"]
    figures = told[0]["result"]["extensions"]
    (key,) = (key for key in figures if key.endswith("/figures/scope/path-length"))
    assert figures[key] == {"value": 200.0, "unit": "mm", "sigma": 0.25}
    assert told[0]["result"]["duration"] == "PT1M1.50S"


def test_a_session_is_the_same_statement_in_every_export() -> None:
    ids = [s["id"] for s in statements(ENTRIES)]
    assert len(set(ids)) == 3
    assert ids == [s["id"] for s in statements(ENTRIES)]
    scored_again = entry(number=2, percent=40.0, has_passed=False)
    assert statements([scored_again])[0]["id"] != ids[1]


def test_a_home_page_must_be_a_url() -> None:
    for home in ("school", "mailto:a@b.org", "https://", "ftp://a.org", "http://a b"):
        with pytest.raises(UserError, match="--home-page"):
            statements(ENTRIES, home)


@given(st.floats(0.0, 1e6))
def test_durations_say_their_seconds(seconds: float) -> None:
    told = iso_duration(seconds)
    assert DURATION.fullmatch(told)
    found = re.fullmatch(r"PT(?:(\d+)M)?(\d+(?:\.\d\d)?)S", told)
    assert found is not None
    minutes = int(found[1] or 0)
    assert float(found[2]) < 60.0
    assert 60 * minutes + float(found[2]) == pytest.approx(seconds, abs=0.0051)
