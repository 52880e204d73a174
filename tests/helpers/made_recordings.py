"""What a recording says of its session, for recordings that tests write themselves."""

from made_patches import hum

from underfoot.floor.layout import default_floor

ABOUT = {
    "patch": hum().dumps().decode(),
    "floor": default_floor(1, 2).dumps().decode(),
    "rate": "48000",
    "force_rate": "1000.0",
    "target": "simulator",
}
