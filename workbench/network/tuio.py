"""TUIO 1.1 and 2.0: contacts in the format of interactive tables and game engines (https://www.tuio.org).

A frame is one datagram with all contacts, so the next one makes up for one that is lost. For TUIO 1.1 the profile is
`/tuio/2Dcur`, which has no force; `/underfoot/contact` has it. For TUIO 2.0 contacts are pointers: pressure is the
force over `FULL_PRESSURE_N`, and the user is the person.
"""

from collections.abc import Sequence

from underfoot.network.live_contacts import LiveContact
from underfoot.network.osc import Double, TimeTag, bundle, message

FULL_PRESSURE_N = 1000.0
"""Force at pressure 1. A jump exceeds it, and is not clipped."""

MOST_CONTACTS = 64
"""Most contacts in a frame, the oldest first, so that it is one datagram below 8 kB."""

_CURSOR = "/tuio/2Dcur"
_UNTYPED, _MOST_USER = 0, 0xFFFF


def cursor_frame(contacts: Sequence[LiveContact], sequence: int, source: str) -> bytes:
    """Return a frame of TUIO 1.1: source, alive, set for each contact, and fseq.

    >>> from underfoot.network.osc import read
    >>> [one.arguments[:2] for one in read(cursor_frame([LiveContact(3, 0.5, 0.5, 1.0, 1.0, 700.0)], 9, "a@b"))]
    [('source', 'a@b'), ('alive', 3), ('set', 3), ('fseq', 9)]
    """
    sent = contacts[:MOST_CONTACTS]
    sets = [
        message(_CURSOR, "set", one.id, one.x, one.y, one.x_velocity, one.y_velocity, one.acceleration) for one in sent
    ]
    alive = message(_CURSOR, "alive", *(one.id for one in sent))
    return bundle([message(_CURSOR, "source", source), alive, *sets, message(_CURSOR, "fseq", sequence)])


def pointer_frame(
    contacts: Sequence[LiveContact], sequence: int, source: str, unix_s: float, size_m: tuple[float, float]
) -> bytes:
    """Return a frame of TUIO 2.0: frm, ptr for each contact, and alv; `size_m` is sent as the sensor size, in mm.

    >>> from underfoot.network.osc import read
    >>> frame = pointer_frame([LiveContact(3, 0.5, 0.5, 1.0, 1.0, 700.0)], 9, "a", 0.0, (2.0, 1.0))
    >>> len(frame)
    172
    """
    sent = contacts[:MOST_CONTACTS]
    width, depth = (min(round(1e3 * side), 0xFFFF) for side in size_m)
    frm = message("/tuio2/frm", sequence, TimeTag.of(unix_s), _signed(width << 16 | depth), source)
    pointers = [
        message(
            "/tuio2/ptr", one.id, _signed(_user(one.person) << 16 | _UNTYPED), 0, one.x, one.y,
            0.0, 0.0, 0.0, one.force_n / FULL_PRESSURE_N,
            one.x_velocity, one.y_velocity, one.force_rate_n_s / FULL_PRESSURE_N, one.acceleration, 0.0,
        )
        for one in sent
    ]  # fmt: skip
    return bundle([frm, *pointers, message("/tuio2/alv", *(one.id for one in sent))])


def contact_messages(contacts: Sequence[LiveContact], time_s: float) -> bytes:
    """Return all contacts in metres and newtons: `/underfoot/contacts` with the session's time and their number, then
    `/underfoot/contact` for each.
    """
    head = message("/underfoot/contacts", Double(time_s), len(contacts[:MOST_CONTACTS]))
    each = (
        message("/underfoot/contact", contact.id, contact.x_m, contact.y_m, contact.force_n, contact.person)
        for contact in contacts[:MOST_CONTACTS]
    )
    return bundle([head, *each])


def _user(person: int) -> int:
    """Return a person's number in 16 bits; after the last one come the first again, who are long gone."""
    return (person - 1) % _MOST_USER + 1 if person else 0


def _signed(number: int) -> int:
    """Convert 32 bits to a signed integer, as OSC has them."""
    return number - (1 << 32) if number >= 1 << 31 else number
