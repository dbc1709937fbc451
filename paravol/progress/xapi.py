"""Sessions as statements of the Experience API, for a learning record store.

By xAPI 1.0.3, part two (adlnet/xAPI-Spec, xAPI-Data.md, sections 2.4 and 4): an actor
is known by an account alone, nothing is null, extensions and verbs are named by IRIs,
durations are ISO 8601 to a hundredth of a second.
"""

import re
import uuid
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote, urlsplit

from paravol.progress.session_entry import NOBODY, SessionEntry
from system import UserError

HOME_PAGE = "https://paravol.invalid"
"""Names the accounts and exercises where a school gives none of its own. The domain
can belong to nobody (RFC 2606)."""

UNNAMED = "unnamed"
"""Begins the account of whoever gave no name; the session follows. Two of them may be
two people: a record store would add up what they did."""

_VERBS = "http://adlnet.gov/expapi/verbs/"
_SIMULATION = "http://adlnet.gov/expapi/activities/simulation"


def statements(
    entries: Sequence[SessionEntry], home_page: str = HOME_PAGE
) -> list[dict[str, Any]]:
    """Return one statement for each session.

    home_page: URL of whoever gave out the names; exercises and figures are named below
    it. A session has the same statement's id in every export, so that a record store
    takes it once; scored again, it is another statement. UserError for no URL.
    """
    base = home_page.rstrip("/")
    parts = urlsplit(base)
    if parts.scheme not in ("http", "https") or not parts.netloc or " " in base:
        raise UserError(
            f"--home-page must be a URL such as https://skills.example.org, got "
            f"{home_page!r}."
        )
    return [_statement(entry, base) for entry in entries]


def iso_duration(seconds: float) -> str:
    """Return an ISO 8601 duration to a hundredth of a second, such as PT2M5.40S."""
    hundredths = round(max(seconds, 0.0) * 100)
    minutes, rest = divmod(hundredths, 6000)
    text = f"{rest // 100}" + (f".{rest % 100:02d}" if rest % 100 else "")
    return f"PT{minutes}M{text}S" if minutes else f"PT{text}S"


def _statement(entry: SessionEntry, base: str) -> dict[str, Any]:
    verb = {True: "passed", False: "failed", None: "completed"}[entry.has_passed]
    scored = entry.scored
    told = "" if scored is None else f"{scored.sha256} {scored.percent}"
    key = f"{base} {entry.trainee} {entry.sha256} {verb} {told}"
    return {
        "id": str(uuid.uuid5(uuid.NAMESPACE_URL, key)),
        "actor": {
            "objectType": "Agent",
            "account": {
                "homePage": base,
                "name": _account(entry),
            },
        },
        "verb": {"id": _VERBS + verb, "display": {"en-US": verb}},
        "object": {
            "objectType": "Activity",
            "id": f"{base}/exercises/{_word(entry.exercise)}",
            "definition": {
                "type": _SIMULATION,
                "name": {"en-US": entry.title or entry.exercise},
            },
        },
        "result": _result(entry, base),
        "context": {"platform": "PARAVOL"},
        "timestamp": entry.begun,
        "version": "1.0.3",
    }


def _account(entry: SessionEntry) -> str:
    """Return a trainee's name, or one for the session of somebody who gave none."""
    if entry.trainee != NOBODY:
        return entry.trainee
    return f"{UNNAMED}-{entry.sha256[:12]}"


def _result(entry: SessionEntry, base: str) -> dict[str, Any]:
    figures = {
        f"{base}/figures/{_word(v.role)}/{_word(v.name)}": {
            "value": v.value,
            "unit": v.unit,
            **({} if v.sigma is None else {"sigma": v.sigma}),
        }
        for v in entry.values
        if v.value is not None
    }
    result: dict[str, Any] = {
        "completion": entry.is_complete,
        "duration": iso_duration(entry.duration_s),
        "extensions": {f"{base}/session": entry.sha256, **figures},
    }
    if entry.has_passed is not None:
        result["success"] = entry.has_passed
    scored = entry.scored
    if scored is not None:
        rubric = {"name": scored.rubric, "version": scored.version}
        result["extensions"][f"{base}/rubric"] = rubric
        if scored.percent is not None:
            raw = min(max(scored.percent, 0.0), 100.0)
            result["score"] = {"scaled": raw / 100, "raw": raw, "min": 0, "max": 100}
    return result


def _word(text: str) -> str:
    """Return a part of an IRI."""
    return quote(re.sub(r"[^\w.]+", "-", text).strip("-").lower() or "-")
