"""A small calibration for tests of the wizard: a scale that is loaded, and a bell that is struck."""

import threading

import numpy as np

from underfoot.calibration.declaration import PRESSING, Calibration
from underfoot.calibration.procedure import Page, PageProgress
from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest, Readings, Sound
from underfoot.drawing import Drawing, series
from underfoot.errors import BadMeasurement, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Response
from underfoot.parameters import Choice, Number, Text, ask

TILE = default_floor().tiles[0]
MIDDLE = (0.02, -0.05)
HELD = 20
"""Readings for which a load must be at rest."""
UNCERTAIN = [f"acceleration_{part}_percent" for part in ("repeatability", "flatness", "linearity")]
PAGES = ("setup", "tare", "weigh", "note", "bell", "result")


class Weighing:
    """Converts counts to newtons by one known weight; a bell gives the tile's level. It makes a `Response`."""

    kind, title = "response", "Weighing"

    def __init__(self, gate=None):
        self._at, self._given = 0, False
        self._taken, self._kept, self._rests, self._heard = [], [], np.zeros(0), np.zeros(0)
        self.answers = {}
        self._gate = gate

    @property
    def page(self):
        key = PAGES[self._at]
        share = self._at / (len(PAGES) - 1)
        match key:
            case "setup":
                questions = (
                    ask("stiffness_n", Number(300.0, 1.0, 1000.0, unit="N", doc="How much it bears.")),
                    ask("kind", Choice("spring", options=("spring", "lever"), doc="What it is.")),
                )
                return Page(key, "Set up", "Say what the scale is.", questions=questions, share=share)
            case "tare":
                return Page(key, "Nothing on it", "Stand clear.", press=PressRequest((0.0, 0.0), 0.0), share=share)
            case "weigh":
                questions = () if self._given else (ask("weight_n", Number(100.0, 0.0, 900.0, unit="N", doc="Known.")),)
                press = PressRequest(MIDDLE, 100.0, 0.5)
                places = ((0.0, 0.0), MIDDLE)
                return Page(key, "Weigh", "Put the weight on.", questions, press, None, places, True, share)
            case "note":
                return Page(
                    key, "A note", "Say who it was.", questions=(ask("who", Text("", doc="A name.")),), share=share
                )
            case "bell":
                sound = Sound(np.sin(np.arange(4800) / 10.0), 48_000, "standing")
                return Page(key, "The bell", "Stand on it.", sound=sound, share=share)
        return Page("result", "Result", "Look at it.", share=1.0, last=True)

    @property
    def progress(self):
        n = len(self._taken)
        force = float(self._taken[-1]) if n else 0.0
        return PageProgress("Hold still.", n / HELD, (("force_n", force, "N"), ("rests", float(n), "")))

    @property
    def drawings(self):
        if not self._taken:
            return ()
        return (
            Drawing("Taken", "reading", "force, N", (series("taken", range(len(self._taken)), self._taken, "dots"),)),
        )

    @property
    def result(self):
        if PAGES[self._at] != "result":
            return None
        level = float(np.abs(self._heard).max()) * 10.0
        part = Response(
            made="2026-02-03", error=0.5, error_allowed=1.0, error_unit="dB", verdict="It rings true.",
            figures={"level_db": level} | dict.fromkeys(UNCERTAIN, 1.0), frequencies_hz=(50.0, 100.0),
            magnitude=(1.0, level), acceleration_per_unit=level,
        )  # fmt: skip
        curve = Drawing("Bell", "frequency, Hz", "level", (series("bell", [50, 100], [1, level]),), x_log=True)
        bell = np.array([[50.0, 1.0], [100.0, level]])
        return Result(
            "response", "Weighing of t1", (("error", 0.5, "dB"), ("level_db", level, "dB")), "It rings true.", True,
            ("the bell is small",), (curve,), (("bell", "frequency_hz,level", bell),),
            part,
        )  # fmt: skip

    def without_conclusion(self, reason):
        raw = (("loads", "force_n", np.array(self._kept)[:, None]),)
        return Result("response", "Weighing of t1", (), reason, False, raw=raw) if self._kept else None

    def answer(self, values):
        page = self.page
        checked = {
            question.name: question.check(values.get(question.name, question.default)) for question in page.questions
        }
        if checked.get("weight_n") == 0.0:
            raise BadMeasurement("0 N was typed; a weight weighs something")
        self.answers |= checked
        if page.press is not None:
            self._given = True
        else:
            self._go(self._at + 1)

    def feed(self, readings):
        self._taken += readings.values.sum(axis=1).tolist()
        if PAGES[self._at] == "weigh" and self._taken and max(self._taken) > 2.0 * self.answers["weight_n"]:
            self._taken, self._given = [], False
            raise BadMeasurement(f"{self.answers['weight_n']:g} N was typed, but the scale says more")
        if len(self._taken) >= HELD:
            self._kept = self._taken
            self._go(self._at + 1)

    def begin_again(self):
        self._go(self._at)

    def take_recording(self, recorded):
        if self._gate is not None:
            self._gate.wait(300.0)
        self._heard = recorded
        self._go(self._at + 1)

    def skip(self):
        if not self.page.may_skip:
            raise BadValue("this page cannot be skipped")
        self._go(self._at + 1)

    def back(self):
        if self._at:
            self._go(self._at - 1)

    def _go(self, at):
        self._at, self._given, self._taken = at, False, []


class Scale:
    """Carries the requested load at once, by hand `hand_n`; ten readings per call, or its `failure`."""

    def __init__(self, by_hand=False):
        self._by_hand, self.hand_n = by_hand, 0.0
        self.asked = PressRequest((0.0, 0.0), 0.0)
        self._samples = 0
        self.reads, self.closed = 0, False
        self.failure = None
        self.loads = []
        self.silenced = threading.Event()

    def press(self, press):
        self.asked = press or PressRequest((0.0, 0.0), 0.0)

    def read(self):
        self.reads += 1
        if self.failure is not None:
            raise self.failure
        force = self.hand_n if self._by_hand else self.asked.force_n
        times = (self._samples + np.arange(10)) / 1000.0
        self._samples += 10
        return Readings(times, np.full((10, 4), force / 4.0))

    def play(self, sound):
        self.loads.append(sound.load)
        return 0.5 * sound.signal

    def silence(self):
        self.silenced.set()

    def close(self):
        self.closed = True


class Bell(Calibration):
    """What the workspace shows of it."""

    kind, name, title, about, rig = "response", "Bell", "Bell: how loud it is", "A weight, and a bell.", PRESSING


class Forces(Bell):
    kind, name = "fsr", "Forces"


class Places(Bell):
    kind, name = "centroid", "Places"


CALIBRATIONS = {one.kind: one for one in (Forces, Places, Bell)}
"""The same under the names of all three parts, as the workspace shows them."""


def weighing(made, by_hand=False, gate=None, failure=None):
    """Return what makes it for the workspace; results are appended to `made`. With a `failure` it fails."""

    def make(calibration, target, tile, profile, reference):
        if failure is not None:
            raise failure
        made.append((Weighing(gate), Scale(by_hand)))
        return made[-1]

    return make
