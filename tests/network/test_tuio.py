"""Contacts as others get them: at once, under ids that last, decoded by other libraries as the specifications say."""

import itertools
import math
from contextlib import closing

import numpy as np
import pytest
from crowds import FEET, Crowd
from made_walks import corner_forces, read, touching_floor, walk
from msgspec.structs import replace
from osc_ends import CursorDecoder, OscEnd
from pythonosc.osc_packet import OscPacket

from underfoot.floor.contacts import ContactTracker, OngoingContact
from underfoot.floor.layout import Floor
from underfoot.network.live_contacts import LiveContact, LiveContacts
from underfoot.network.tuio import MOST_CONTACTS, cursor_frame, pointer_frame

SOURCE = "underfoot@127.0.0.1"


def messages(datagram):
    return [(timed.message.address, *timed.message.params) for timed in OscPacket(datagram).messages]


def test_a_cursor_frame_is_as_tuio_1_1_has_it():
    contact = LiveContact(7, 0.25, 0.75, 1.0, 2.0, 500.0, 2, 0.5, -0.25, 1.5, 100.0)
    source, alive, moved, end = messages(cursor_frame([contact], 41, SOURCE))
    assert source == ("/tuio/2Dcur", "source", SOURCE)
    assert alive == ("/tuio/2Dcur", "alive", 7)
    assert moved == ("/tuio/2Dcur", "set", 7, 0.25, 0.75, 0.5, -0.25, 1.5)
    assert end == ("/tuio/2Dcur", "fseq", 41)
    assert messages(cursor_frame([], 42, SOURCE))[1:] == [("/tuio/2Dcur", "alive"), ("/tuio/2Dcur", "fseq", 42)]


def test_a_pointer_frame_is_as_tuio_2_0_has_it_and_brings_force():
    contact = LiveContact(7, 0.25, 0.75, 1.0, 2.0, 500.0, 2, 0.5, -0.25, 1.5, 250.0)
    frm, ptr, alv = messages(pointer_frame([contact], 41, "underfoot", 1_000_000_000.5, (40.0, 1.5)))
    address, sequence, _, dimension, source = frm
    assert (address, sequence, source) == ("/tuio2/frm", 41, "underfoot")
    assert dimension & 0xFFFFFFFF == 40_000 << 16 | 1500
    assert ptr == ("/tuio2/ptr", 7, 2 << 16, 0, 0.25, 0.75, 0.0, 0.0, 0.0, 0.5, 0.5, -0.25, 0.25, 1.5, 0.0)
    assert alv == ("/tuio2/alv", 7)
    frm, ptr, _ = messages(pointer_frame([LiveContact(7, 0.5, 0.5, 1.0, 2.0, 1.0, 70_000)], 1, "a", 0.0, (70.0, 1.5)))
    assert frm[3] & 0xFFFFFFFF == 0xFFFF << 16 | 1500, "the most that is sent"
    assert ptr[2] == 4465 << 16, "after 65,535 persons"


def test_a_frame_stays_one_datagram():
    crowd = [LiveContact(id, 0.5, 0.5, 1.0, 1.0, 700.0) for id in range(200)]
    cursors, pointers = cursor_frame(crowd, 1, SOURCE), pointer_frame(crowd, 1, SOURCE, 0.0, (1.0, 1.0))
    assert len(cursors) < 8192
    assert len(pointers) < 8192
    alive = list(range(MOST_CONTACTS))
    assert messages(cursors)[1] == ("/tuio/2Dcur", "alive", *alive)
    assert messages(pointers)[-1] == ("/tuio2/alv", *alive)


def test_twelve_contacts_keep_their_ids_and_none_is_lost():
    """Four seconds here; ten minutes by hand, also by the reference clients of both protocols (docs/network.md)."""
    seconds, crowd, decoder = 4.0, Crowd(), CursorDecoder()
    tiles, most = {}, 0
    with closing(OscEnd()) as sender, closing(OscEnd()) as client:
        for number, frame in enumerate(crowd.frames(seconds), 1):
            sender.send(client.port, cursor_frame(frame.contacts, number, SOURCE))
            (datagram,) = client.datagrams()
            decoder.decode(datagram)
            here = {crowd.tile_at(contact.x_m, contact.y_m) for contact in frame.contacts}
            assert frame.certain <= here <= frame.possible
            assert len(here) == len(decoder.cursors)
            most = max(most, len(here))
            for contact in frame.contacts:
                assert decoder.cursors[contact.id][:2] == pytest.approx((contact.x, contact.y), abs=1e-6)
                assert tiles.setdefault(contact.id, crowd.tile_at(contact.x_m, contact.y_m)) in here
    begun, ended = crowd.stances(seconds)
    assert most == FEET
    assert decoder.sequences == list(range(1, round(60 * seconds) + 1))
    assert decoder.added == list(range(1, begun + 1))
    assert abs(len(decoder.removed) - ended) <= 1


def test_a_foot_that_rolls_over_a_seam_is_one_contact():
    floor = touching_floor(1, 8)
    feet = walk(3, heel_m=(0.225, 0.15), step_m=0.6, width_m=0.1)
    time_s = np.arange(3000) / 1000.0
    forces = read(corner_forces(floor, feet, time_s), 1000.0)
    tracker, live = ContactTracker(floor, 1000.0), LiveContacts(floor)
    ids, first_at, tiles = [], {}, set()
    for at in range(0, 3000, 16):
        tracker.feed(time_s[at : at + 16], forces[at : at + 16])
        now_s = float(time_s[min(at + 15, 2999)])
        ongoing = tracker.ongoing()
        tiles |= {contact.tiles for contact in ongoing}
        for contact in live.update(now_s, ongoing):
            first_at.setdefault(contact.id, now_s)
            ids.append(contact.id)
    assert any(len(some) > 1 for some in tiles), "a foot lies on two tiles"
    assert sorted(first_at) == [1, 2, 3]
    assert ids == sorted(ids) or set(ids) == {1, 2, 3}
    for foot, at_s in zip(feet, first_at.values(), strict=True):
        assert at_s - foot.start_s < 0.05, "nobody waits for the decision whose foot it is"


def test_velocities_are_those_of_the_place():
    floor = touching_floor(1, 2)
    time_s = np.arange(1500) / 1000.0
    forces = corner_forces(floor, walk(1, heel_m=(0.08, 0.15), duration_s=0.8), time_s)
    tracker, live = ContactTracker(floor, 1000.0), LiveContacts(floor)
    found = []
    for at in range(0, 1500, 20):
        tracker.feed(time_s[at : at + 20], forces[at : at + 20])
        now_s = float(time_s[at + 19])
        found += [(now_s, contact) for contact in live.update(now_s, tracker.ongoing())]
    assert len(found) > 30
    for (before_s, before), (now_s, now) in itertools.pairwise(found):
        assert now.x_velocity == pytest.approx((now.x - before.x) / (now_s - before_s))
        assert now.x == pytest.approx(now.x_m / 0.6, abs=1e-9)
        assert now.y == pytest.approx(1.0 - now.y_m / 0.3, abs=1e-9)


def test_places_and_motion_are_of_the_floor_s_box_wherever_it_lies_and_a_restart_begins_new_contacts():
    tiles = touching_floor(1, 2).tiles
    floor = Floor(tuple(replace(one, centre_m=(one.centre_m[0] - 1.0, one.centre_m[1] + 2.0)) for one in tiles))
    live = LiveContacts(floor)
    before = OngoingContact(0, -0.85, 2.1, 300.0, (0,), loads=(0,))
    after = OngoingContact(0, -0.79, 2.13, 320.0, (0,), loads=(0,))
    (first,) = live.update(5.0, [before])
    assert (first.id, first.x, first.y) == (1, pytest.approx(0.25), pytest.approx(2.0 / 3.0))
    for _ in range(2):  # a sample that is read again has the motion that it had
        (moved,) = live.update(5.1, [after])
        motion = (moved.x_velocity, moved.y_velocity, moved.acceleration, moved.force_rate_n_s)
        assert motion == pytest.approx((1.0, -1.0, 10.0 * math.sqrt(2.0), 200.0))
    (again,) = live.update(0.1, [after])
    assert (again.id, again.x_velocity, again.acceleration) == (2, 0.0, 0.0)
