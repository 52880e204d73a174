"""`underfoot scene`: the list, what it refuses, and a film of a simulated walk."""

from underfoot.records.recording import Recording
from underfoot.scenes import discover


def test_scenes_are_listed_with_their_parameters(underfoot):
    said = underfoot("scene")
    assert said.status == 0
    for name, kind in discover().items():
        assert name in said.out
        assert all(parameter in said.out for parameter in kind.parameters)


def test_what_cannot_be_is_refused_in_a_line(refused):
    assert "frozen-pond" in refused("scene", "lake")
    assert "allowed" in refused("scene", "frozen-pond", "--set", "depth=3")
    assert "0 to 2" in refused("scene", "frozen-pond", "--set", "turn=9")
    assert "allowed" in refused("scene", "footprints", "--set", "ground=lava")
    assert "--seconds" in refused("scene", "frozen-pond", "--film", "a.gif")
    assert "ends in .gif" in refused("scene", "frozen-pond", "--film", "a.mp4", "--seconds", "1")
    assert "ends in .png" in refused("scene", "frozen-pond", "--picture", "a.jpg", "--seconds", "1")
    assert "above 0" in refused("scene", "frozen-pond", "--seconds", "0")
    assert "-120 to 0 dB" in refused("scene", "frozen-pond", "--level", "nan")
    assert "folder" in refused("scene", "frozen-pond", "--picture", "nowhere/a.png")
    assert "walk.csv" in refused("scene", "frozen-pond", "--target", "walk.csv")


def test_measuring_refuses_what_it_would_not_use(refused):
    """Else the latency of the simulated floor would be taken for that of the hardware that was named."""
    for option, value in (("--target", "udp:127.0.0.1:4711"), ("--record", "a.underfoot"), ("--picture", "a.png")):
        assert f"{option} is given with --measure;" in refused("scene", "touch-widgets", "--measure", option, value)


def test_a_walk_is_played_printed_and_filmed(underfoot, folder):
    files = ("--film", "feet.gif", "--picture", "feet.png", "--width", "96", "--record", "feet.underfoot")
    said = underfoot("scene", "target-selection", "--seconds", "1.2", "--set", "pause_s=0.2", "--level", "-6", *files)
    assert said.status == 0, said.error
    assert "to come" in said.out
    film, picture = (folder / "feet.gif").read_bytes(), (folder / "feet.png").read_bytes()
    assert film.startswith(b"GIF89a")
    assert film.count(b"\x21\xf9\x04") >= 3  # pictures
    assert picture.startswith(b"\x89PNG")
    with Recording(folder / "feet.underfoot") as recording:
        assert (0, "Level", '{"db":-6.0}') in recording.commands()
