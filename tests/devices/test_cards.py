"""Several sound cards: which channels go where, two real streams on two clocks, and a card that goes and comes back."""

import os
import re
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from live import live
from made_patches import hum
from null_sink import listening

from underfoot.devices.outputs import Output, card_channels, outputs_of, text_of
from underfoot.devices.sound import devices
from underfoot.engine import card_search
from underfoot.engine.card_search import CardSearch, CardWatch
from underfoot.engine.commands import Level, Panic
from underfoot.engine.reports import SOUND_CARD, Notice, OutputChanged
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor

CARDS = "left=18; right=18"
SINE = {"frequency": 100.0, "harmonics": (1.0,), "amplitude": 4.0}
BUFFER_S = 0.08


@pytest.mark.parametrize(
    ("text", "says"),
    [("a=0", "1 to 32"), ("a=33", "1 to 32"), ("a; a", "each card once"), (";".join("abcdefghi"), "at most 8")],
)
def test_cards_that_cannot_be_are_refused_in_one_line(text, says):
    with pytest.raises(BadValue, match=says):
        outputs_of(text)


def test_an_engine_that_refuses_its_cards_says_one_line(until, monkeypatch, capfd):
    """Python wrote twenty more of memory that nothing had released."""
    monkeypatch.setattr("underfoot.engine.session.MOST_DEATHS", 0)
    with live(hum(), until, sound="a; a") as playing:
        playing.until(lambda: playing.of(OutputChanged), "it is given up")
    assert playing.of(Notice)[0].text == "the engine stopped: sound device is 'a; a'; allowed: each card once"
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("text", ["", "USB Audio: - (hw:1,0)=18; default", "a; b; c=3"])
def test_the_text_of_cards_is_read_as_it_is_written(text):
    assert text_of(outputs_of(text)) == text


def test_channels_are_laid_on_one_card_after_the_other():
    cards = card_channels("nowhere A=18; nowhere B=18; nowhere C", 36)
    assert [(card.output, card.first, card.count) for card in cards] == [
        (Output("nowhere A", 18), 0, 18),
        (Output("nowhere B", 18), 18, 18),
    ]
    assert [card.count for card in card_channels("nowhere A=18; nowhere B=10", 36)] == [18, 10]


def playing_on(until, sound=CARDS):
    return live(hum(tone=SINE), until, sound=sound, latency_s=BUFFER_S, floor=default_floor(6, 6), walker=False)


def test_thirty_six_tiles_play_on_two_cards(two_sinks, until):
    first, second = two_sinks
    with listening(first) as left, listening(second) as right, playing_on(until) as playing:
        assert playing.started().notice == ""
        playing.session.send(Level(0.0))
        for heard in (left, right):
            until(
                lambda heard=heard: len(heard()) and np.abs(heard()[-4800:]).max(axis=0).min() > 0.05,
                "all 18 sound",
                seen=heard.summary,
            )
        playing.play(48_000)
        health = playing.session.health
        assert 0.0 < health.cards_delay_s <= 0.25
        assert abs(health.cards_offset_s) < health.cards_delay_s
        playing.session.send(Panic())
        for heard in (left, right):
            until(lambda heard=heard: not heard()[-4800:].any(), "a panic silences both", seen=heard.summary)


def test_where_the_first_card_is_missing_the_second_is_a_sound_card_that_plays(two_sinks, until):
    """It was called a session without sound, which the window lets sound at once, with nobody asked."""
    with playing_on(until, "none=18; right=18") as playing:
        started = playing.started()
        assert started.where == SOUND_CARD
        told = "sound device 'none' cannot play .*; cards: .*left, .*right.*; silent: t1, t2, .*, t18"
        assert re.fullmatch(told, started.notice)


def test_a_card_that_comes_under_a_new_name_is_found_without_loading_portaudio_anew_here(null_sink):
    known = {card.name for card in devices()}
    with Path(os.environ["ALSA_CONFIG_PATH"]).open("a") as names:
        names.write(f'pcm.later {{ type pulse\n server "unix:{null_sink.socket}"\n hint {{ show on }} }}\n')
    assert {card.name for card in devices()} == known
    assert "later" in {card.name for card in CardSearch().find()} - known


def test_missing_cards_are_looked_for_ever_more_rarely(null_sink, monkeypatch):
    """Each look takes the processor from what plays."""
    now_s, watch, found = [0.0], CardWatch(), []
    monkeypatch.setattr(card_search, "time", SimpleNamespace(perf_counter=lambda: now_s[0]))
    while len(found) < 2:
        if (there := watch.poll(("none", "uf", ""))) is not None:
            found.append((now_s[0], there))
        if watch.pid is None:  # no time passes during a look
            now_s[0] += 0.5
    assert found == [(at_s, {"uf": "uf", "": "default"}) for at_s in (2.0, 6.0)]
    assert watch.poll(()) is None


def test_a_card_whose_server_stands_still_is_told_with_its_tiles_until_it_goes_on(two_sinks, until):
    """Its tiles were silent for as long as that lasted, and nobody was told."""
    server = min(two_sinks[1].threads())
    with playing_on(until) as playing:
        playing.started()
        try:
            os.kill(server, signal.SIGSTOP)
            playing.until(lambda: playing.of(OutputChanged), "it is told")
        finally:
            os.kill(server, signal.SIGCONT)
        playing.until(lambda: len(playing.of(OutputChanged)) > 1, "it is back")
    still, back = playing.of(OutputChanged)
    assert still.text.startswith("sound device 'right' stands still; silent: t19, t20")
    assert still.silence == still.text
    assert back.text.startswith("sound device 'right' is back; it plays t19, t20")
    assert back.silence == ""


def test_a_server_that_stands_still_before_a_card_is_open_is_told_until_it_goes_on(null_sink, until):
    """The engine waited for it for ever, and nobody was told why nothing played."""
    server = min(null_sink.threads())
    os.kill(server, signal.SIGSTOP)
    try:
        with live(hum(tone=SINE), until, sound="", latency_s=BUFFER_S, walker=False) as playing:
            playing.until(lambda: playing.of(OutputChanged), "it is told")
            os.kill(server, signal.SIGCONT)
            assert playing.started().notice == ""
            (told,) = playing.of(OutputChanged)
            assert (
                told.text == told.silence == "the sound card and its server do not answer; nothing plays until they do"
            )
    finally:
        os.kill(server, signal.SIGCONT)


def test_a_card_that_comes_later_plays_and_one_that_goes_silences_its_tiles_and_comes_back(two_sinks, until):
    """One that was missing at the start was never found: PortAudio makes its list anew only where nothing plays."""
    first, second = two_sinks
    second.stop()
    with listening(first) as left, playing_on(until) as playing:
        playing.session.send(Level(0.0))
        until(lambda: len(left()) and left()[-480:].any(), "the first card sounds")
        second.start()
        with listening(second) as right:
            playing.until(lambda: len(playing.of(Notice)) > 1, "it is there")
            until(lambda: len(right()) and np.abs(right()[-480:]).max(axis=0).min() > 0.05, "its tiles sound")
        until(lambda: left()[-480:].any(), "the first card sounds again")
        pause, back = playing.of(OutputChanged)
        assert pause.silence == "a sound card has come; the others pause until the cards are listed"
        assert back.text.startswith("sound device 'right' is back; it plays t19, t20")
        assert back.silence == ""
        playing.reports.clear()
        second.stop()
        playing.until(lambda: playing.of(Notice), "it is told")
        assert playing.of(Notice)[0].text.startswith("sound device 'right' has gone; silent: t19, t20")
        before = len(left())
        until(lambda: np.abs(left()[before + 24_000 :]).max(initial=0.0) > 0.05, "the first card plays on")
        second.start()
        with listening(second) as right:
            playing.until(lambda: len(playing.of(Notice)) > 1, "it is back")
            until(lambda: len(right()) and np.abs(right()[-480:]).max(axis=0).min() > 0.05, "its tiles sound again")
