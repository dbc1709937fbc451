"""What the scope touched, how long and how deep."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.episodes import held, intervals, weights
from scenarios.metrics.measured import Contacts, Measured
from scenarios.metrics.metric import (
    SCOPE,
    Answer,
    Definition,
    Found,
    Interval,
    too_little,
)
from scenarios.metrics.motion import way_within_mm

Doubles = NDArray[np.float64]

UNMEASURED = "the head around the scope was not measured"


def in_contact(measured: Measured, contacts: Contacts) -> NDArray[np.bool_]:
    """Return whether the scope touches ``(n,)``: from gap 0 on, until it is clear.

    Without that hysteresis the number of contacts would depend on the sampling rate.
    """
    close_mm = measured.settings.contact_close_mm
    return held(contacts.gap_mm < 0.0, contacts.gap_mm > close_mm)


def _spans(measured: Measured) -> tuple[Contacts, tuple[Interval, ...]] | Found:
    contacts = measured.contacts
    if contacts is None:
        return Found(None, (), UNMEASURED)
    if len(contacts.time_s) < 2:
        return too_little("two samples are needed")
    state = in_contact(measured, contacts)
    return contacts, intervals(contacts.time_s, state, measured.settings.gap_s)


def contact_count(measured: Measured) -> Found:
    """Return how often the scope came to touch."""
    found = _spans(measured)
    if isinstance(found, Found):
        return found
    return Found(float(len(found[1])), found[1])


def contact_s(measured: Measured, *, is_share: bool) -> Found:
    """Return how long the scope touched, s or as a share of the time measured."""
    found = _spans(measured)
    if isinstance(found, Found):
        return found
    contacts, spans = found
    touched_s = sum(end - begin for begin, end in spans)
    if not is_share:
        return Found(touched_s, spans)
    whole_s = float(weights(contacts.time_s, measured.settings.gap_s).sum())
    if not whole_s > 0.0:
        return too_little("time must go on between samples")
    return Found(touched_s / whole_s, spans)


def deepest_mm(measured: Measured, factor: float = 1.0) -> Found:
    """Return the deepest contact, 0 without any, times a factor."""
    found = _spans(measured)
    if isinstance(found, Found):
        return found
    contacts, spans = found
    if not spans:
        return Found(0.0)
    at = int(np.argmin(contacts.gap_mm))
    time_s = float(contacts.time_s[at])
    return Found(factor * max(-float(contacts.gap_mm[at]), 0.0), ((time_s, time_s),))


def nominal_force_n(measured: Measured) -> Found:
    """Return the force of the deepest contact on a spring; nominal, no measurement."""
    return deepest_mm(measured, measured.settings.stiffness_n_mm)


def touched_way_mm(measured: Measured) -> Found:
    """Return the length of the tip's way in contact."""
    found = _spans(measured)
    if isinstance(found, Found):
        return found
    total = sum(
        way_within_mm(piece, span)
        for piece in measured.scope_pieces
        for span in found[1]
    )
    return Found(total, found[1])


def contact_by_structure_s(measured: Measured) -> Answer:
    """Return how long each structure was touched."""
    found = _spans(measured)
    if isinstance(found, Found):
        return {} if measured.contacts is None else {"any": found}
    contacts, _ = found
    gap_s = measured.settings.gap_s
    lasting = weights(contacts.time_s, gap_s)
    state = in_contact(measured, contacts)
    codes = contacts.touched
    # until a contact is clear it is one of what was touched last
    last = np.maximum.accumulate(np.where(codes >= 0, np.arange(len(codes)), -1))
    named = np.where(last >= 0, codes[np.maximum(last, 0)], -1)
    answer = {}
    for code, name in enumerate(contacts.names):
        mine = state & (named == code)
        if mine.any():
            spans = intervals(contacts.time_s, mine, gap_s)
            answer[name] = Found(float(lasting[mine].sum()), spans)
    return answer


CONTACT = (
    Definition("contacts", SCOPE, "count", contact_count),
    Definition("contact time", SCOPE, "s", partial(contact_s, is_share=False)),
    Definition("contact share", SCOPE, "1", partial(contact_s, is_share=True)),
    Definition("contact time on", SCOPE, "s", contact_by_structure_s),
    Definition("way in contact", SCOPE, "mm", touched_way_mm, "low-passed"),
    Definition("deepest contact", SCOPE, "mm", deepest_mm),
    Definition("nominal force", SCOPE, "N (nominal)", nominal_force_n),
)
