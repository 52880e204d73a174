"""Studies on hardware whose sound card is not there."""

from free_ports import free_port
from live import LONG_BLOCK
from made_studies import made_protocol
from people import open_session, taking_part

from underfoot.engine.reports import Started
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.studies.phase import Phase


def test_no_study_goes_on_where_an_engine_does_not_find_its_sound_card(until, tmp_path):
    """It said so in a line, at its start and after a death, and trials in which nothing could be felt counted."""
    board = Target(default_floor(1, 1), kind="udp", source=str(free_port()), sound="no such card", block=LONG_BLOCK)
    away = "sound device 'no such card' is not there"
    with open_session(until, board) as opened, taking_part(opened, made_protocol("rating"), tmp_path / "a", until) as p:
        p.until_phase(Phase.STOPPED)
        said = p.runner.messages.count(away)
        p.runner.poll([Started("udp, without sound", away)])  # as of another engine
        assert p.runner.messages.count(away) == said + 1 > 1
