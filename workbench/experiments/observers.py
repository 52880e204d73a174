"""Simulated participants with known parameters: their answers, and the estimates that an analysis should find.

Parameters are the true values; their defaults are the thesis's results, where it has some.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property

import numpy as np

from underfoot.arguments import choice
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis import constant, magnitudes, thesis
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods.adjustment import ASCENDING, LEVEL_DB, SET_TO, place_of_standard
from underfoot.experiments.methods.free_labels import sorts_of
from underfoot.experiments.methods.staircases import GUESSED, PSE, THRESHOLD, balanced_share, is_silent
from underfoot.experiments.observer import Observer
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.questions import FIRST, NO, SECOND, YES
from underfoot.experiments.raters import PairJudge, Rater, ratios_of, rows_of_stimuli
from underfoot.experiments.study import Page
from underfoot.experiments.table import LEVEL, Row
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import Number, Parameter


class Identifier(Observer):
    """Identifies stimuli at a rate that increases from session to session; errors are uniform over the other answers.

    People differ slightly here, as in labels and targets. A share of few trials has few possible values, so the
    coverage of a single true value would depend on that value more than on the interval.
    """

    methods = ("absolute-identification",)
    first_rate = Number(0.45, 0.0, 1.0, doc="Share of right answers in the first session.")
    last_rate = Number(0.70, 0.0, 1.0, doc="Share that learning tends to.")
    learning = Number(0.62, 0.0, 10.0, doc="How fast: what is missing falls by exp(-this) each session.")
    rates_differ = Number(0.3, 0.0, 3.0, doc="Standard deviation of rates from person to person, in logits.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        labels = self.given["answers"]
        most = len(labels) or len(self.given["identified"])
        number = correct = labels.index(trial.correct) + 1 if labels else int(trial.correct)
        if random.random() >= self._rate(trial.block):
            other = int(random.integers(1, most))
            number = other + (other >= correct)
        return {"answer": labels[number - 1]} if labels else {"number": number}

    def truths(self) -> dict[str, float]:
        sessions = range(1, self.given["sessions"] + 1)
        rates = {session: self._rate(session) for session in sessions}
        mean = sum(rates.values()) / len(rates)
        found = {"rate": mean, "information": self._bits(mean)}
        return found | {f"rate in session {session}": rate for session, rate in rates.items()}

    def _bits(self, rate: float) -> float:
        names, text = self.given["identified"], self.given["answers"]
        right = [text.index(self.protocol.stimuli[name].correct) for name in names] if text else range(len(names))
        return uniform_guess_bits(rate, len(text) or len(names), right)

    def _rate(self, session: int) -> float:
        last: float = self.truth["last_rate"]
        rate = last + (self.truth["first_rate"] - last) * math.exp(-self.truth["learning"] * (session - 1))
        return _moved(rate, self.truth["rates_differ"] * self.place)


def uniform_guess_bits(rate: float, answers: int, right: Sequence[int] = ()) -> float:
    """Return the transmitted information in bits, for a rate of right answers and uniformly distributed errors.

    `right` is the index of the right answer to each stimulus, if several stimuli share one; by default each has its
    own.

    >>> round(uniform_guess_bits(0.61, 8), 3), uniform_guess_bits(1.0, 2, (0, 0, 1, 1))
    (0.94, 1.0)
    """
    right = right or range(answers)
    table = np.full((len(right), answers), (1.0 - rate) / (answers - 1))
    table[range(len(right)), list(right)] = rate
    whole, *each = (-sum(p * math.log2(p) for p in line if p > 0.0) for line in (table.mean(axis=0), *table))
    return float(whole - np.mean(each))


class Detector(Observer):
    """Detects a stimulus with a probability that is a cumulative normal function of its level in dB."""

    methods = ("staircases",)
    threshold_m_s2 = Number(thesis.THRESHOLD_M_S2, 0.001, 100.0, doc="Where it is felt half of the time.", unit="m/s^2")
    spread_db = Number(2.0, 0.1, 20.0, doc="Standard deviation of the threshold from trial to trial.", unit="dB")
    guesses = Number(0.02, 0.0, 0.5, doc="Share of yes where nothing is felt.")
    lapses = Number(0.02, 0.0, 0.5, doc="Share of no where it is felt.")
    equal_db = Number(
        0.0, -30.0, 30.0, doc="With a standard that vibrates: where the comparison feels as strong.", unit="dB"
    )

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        level = trial.facts.get("level_db")
        felt = 0.0
        if level is not None:  # a catch trial has no level, and compares nothing
            middle = self._middle_of(str(trial.facts["comparison"]))
            felt = _normal((float(level) - middle) / self._spread_db)
        guesses = self.truth["guesses"]
        yes = random.random() < guesses + (1.0 - guesses - self.truth["lapses"]) * felt
        if len(trial.intervals) < 2:
            return {"felt": YES if yes else NO}
        if self.given.get("intervals") == "two" or self._is_silent:  # an undetected stimulus is guessed
            yes = yes or random.random() < GUESSED
        comparison_first = trial.facts["comparison_at"] == FIRST
        return {"interval": FIRST if yes == comparison_first else SECOND}

    def truths(self) -> dict[str, float]:
        # Guesses, lapses and rules such as two down, one up shift the level to which a staircase tends.
        guesses, lapses = self.truth["guesses"], self.truth["lapses"]
        share = balanced_share(self.given)
        if self._is_silent:
            share = (share - GUESSED) / (1.0 - GUESSED)
        felt = (share - guesses) / (1.0 - guesses - lapses) if guesses + lapses < 1.0 else math.nan
        shift = self._spread_db * _normal_inverse(felt) if 0.0 < felt < 1.0 else math.nan  # it tends to no level
        point = PSE if self._is_compared else THRESHOLD
        return {f"{point} {name}": self._middle_of(name) + shift for name in self.given["followed"]}

    def used(self) -> Sequence[str]:
        unused = "threshold_m_s2" if self._is_compared else "equal_db"
        return tuple(name for name in self.parameters if name != unused)

    @property
    def _is_compared(self) -> bool:
        """Whether there is a standard that vibrates."""
        return bool(self.given.get("standard")) and not self._is_silent

    @property
    def _is_silent(self) -> bool:
        return is_silent(self.given, self.protocol.stimuli)

    @property
    def _spread_db(self) -> float:
        return float(self.truth["spread_db"])

    def _middle_of(self, stimulus: str) -> float:
        if self._is_compared:
            return float(self.truth["equal_db"])
        return 20.0 * math.log10(self.truth["threshold_m_s2"] / self.protocol.stimuli[stimulus].level_m_s2)


class SlopedDetector(Detector):
    """A detector for methods that also estimate the spread. People differ in it: the coverage of a single true value
    depends on its distance from the middle of the prior.
    """

    methods = ("bayesian",)
    spreads_differ = Number(0.5, 0.0, 2.0, doc="Standard deviation of the spread's logarithm from person to person.")

    def truths(self) -> dict[str, float]:
        name = self.given["followed"]
        return {f"threshold {name}": self._middle_of(name), "spread": self._spread_db}

    @property
    def _spread_db(self) -> float:
        return float(self.truth["spread_db"] * math.exp(self.truth["spreads_differ"] * self.place))


class Adjuster(Observer):
    """Sets what is moved to where it is right, with a spread, and nearer to where it began, or farther from it.

    What is right is the threshold of a level, the standard where the protocol says where it is, or else the middle of
    what can be set. Truths are shares of the whole way, so that they are for levels and for other numbers.
    """

    methods = ("adjustment",)
    threshold_m_s2 = Number(thesis.THRESHOLD_M_S2, 0.001, 100.0, doc="What is just felt.", unit="m/s^2")
    error_share = Number(0.0, -1.0, 1.0, doc="With a standard: how much more than that is set, of the whole way.")
    spread_share = Number(0.03, 0.0, 1.0, doc="Standard deviation of what is set, of the whole way.")
    start_share = Number(-0.02, -1.0, 1.0, doc="Ascending minus descending settings, of the whole way.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        low, high = self.given["reach"]
        to_start = 0.5 if trial.facts["series"] == ASCENDING else -0.5
        way = to_start * self.truth["start_share"] + self.truth["spread_share"] * random.standard_normal()
        at = self._right_of(str(trial.facts["comparison"])) + way * (high - low)
        return {SET_TO if self.given["parameter"] else LEVEL_DB: float(min(max(at, low), high))}

    def truths(self) -> dict[str, float]:
        low, high = self.given["reach"]
        shares = {"CE": self.truth["error_share"], "SD": self.truth["spread_share"], "start": self.truth["start_share"]}
        found = {}
        for name in self.given["followed"]:
            found[f"{PSE if self.given['standard'] else THRESHOLD} {name}"] = self._right_of(name)
            found |= {f"{word} {name}": share * (high - low) for word, share in shares.items()}
        return found

    def used(self) -> Sequence[str]:
        unused = {"threshold_m_s2"} if self.given["standard"] or self.given["parameter"] else set[str]()
        unused |= set() if self.given["standard"] else {"error_share"}
        return tuple(name for name in self.parameters if name not in unused)

    def _right_of(self, stimulus: str) -> float:
        """Return where settings of a stimulus lie on average."""
        low, high = self.given["reach"]
        if self.given["standard"]:
            at = place_of_standard(stimulus, self.given, self.protocol.stimuli)
            return (0.5 * (low + high) if at is None else at) + float(self.truth["error_share"]) * (high - low)
        if self.given["parameter"]:
            return 0.5 * (low + high)
        return 20.0 * math.log10(self.truth["threshold_m_s2"] / self.protocol.stimuli[stimulus].level_m_s2)


class Discriminator(Observer):
    """Compares numbers with a spread; vibration shifts the point of subjective equality and increases the spread.

    With the defaults, PSE and slope of stiffness are those of table 6.3 at its levels, linear in between; those of
    another number, such as a latency, are shares of the way from the least to the most. If only the level of vibration
    differs, also in another unit such as dB, the level is judged: against the standard's, or against a threshold. A
    stimulus without the number, such as a catch trial, is answered rightly, or, where nothing is right, by whether it
    vibrates.
    """

    methods = ("constant-stimuli",)
    pse_0 = Number(thesis.PSE_N_MM[0.0], 1.0, 10000.0, doc="Where both seem equal, without vibration.", label="PSE 0")
    pse_half = Number(thesis.PSE_N_MM[0.43], 1.0, 10000.0, doc="The same at 0.43 m/s^2.", label="PSE half")
    pse_full = Number(thesis.PSE_N_MM[0.86], 1.0, 10000.0, doc="The same at 0.86 m/s^2.", label="PSE full")
    slope_0 = Number(thesis.SLOPE_MM_N[0.0], 1e-4, 10.0, doc="Probits a unit, without vibration.")
    slope_1 = Number(thesis.SLOPE_MM_N[0.86], 1e-4, 10.0, doc="The same with vibration.")
    pse_share = Number(0.5, -2.0, 3.0, doc="Where half are judged more: of the way from the least number to the most.")
    pse_spread = Number(0.2, 0.001, 10.0, doc="Standard deviation of what is judged, of that way.")
    mistakes = Number(0.0, 0.0, 0.5, doc="Share of answers at chance.")
    judged_more = Number(0.7, 0.0, 1.0, doc="Share of comparisons that are judged more, where no factor is a number.")
    threshold_m_s2 = Number(thesis.THRESHOLD_M_S2, 0.001, 100.0, doc="Where it is felt half of the time.", unit="m/s^2")
    level_spread = Number(0.25, 0.01, 3.0, doc="Standard deviation of a judged level, as a share of the PSE.")

    def __init__(self, truth: Mapping[str, float], protocol: Protocol, stage: Stage, place: float = 0.0) -> None:
        super().__init__(truth, protocol, stage, place)
        self._axis = self._condition = ""
        rows: list[Row] = rows_of_stimuli(protocol, self.given["comparisons"])
        with suppress(BadMeasurement):  # no factor is a number
            rows, self._axis, self._condition = constant.prepared(rows)
        self._places = {str(row["stimulus"]): row for row in rows if self._axis}
        self._judges_level = bool(self._axis) and constant.is_level(rows, self._axis)

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        more = random.random() < self._chance(trial)
        if random.random() < self.truth["mistakes"]:
            more = random.random() < 0.5
        if "comparison_at" not in trial.facts:
            return {"felt": YES if more else NO}
        chosen = more != (trial.facts.get("judged_more") == "not chosen")
        comparison_first = trial.facts["comparison_at"] == FIRST
        return {"interval": FIRST if chosen == comparison_first else SECOND}

    def truths(self) -> dict[str, float]:
        found: dict[str, float] = {}
        if not self._axis:
            mistakes = self.truth["mistakes"]
            share = (1.0 - mistakes) * self.truth["judged_more"] + 0.5 * mistakes
            return {f"share {name}": share for name in self.given["comparisons"]}
        for row in self._places.values():
            pse, slope = self._at(float(row.get(LEVEL, 0.0)))
            value = f" {row[self._condition]}" if self._condition else ""  # the analysis's name
            half = "pse" if self.given["standard"] and not self._guesses else "threshold"
            found |= {f"{half}{value}": pse, f"slope{value}": slope, f"intercept{value}": -slope * pse}
            if not self._guesses:
                found[f"{constant.JND}{value}"] = constant.QUARTER / slope
        return found

    def used(self) -> Sequence[str]:
        if not self._axis:
            return "judged_more", "mistakes"
        if self._judges_level:
            return *(() if self._standard else ("threshold_m_s2",)), "level_spread", "mistakes"
        if self._axis != _STIFFNESS:
            return "pse_share", "pse_spread", "mistakes"
        vibrate = any(row.get(LEVEL) for row in self._places.values())
        return *(_OF_STIFFNESS if vibrate else ("pse_0", "slope_0")), "mistakes"

    def _chance(self, trial: Trial) -> float:
        """Return the probability that the comparison is judged more."""
        row = self._places.get(name := str(trial.facts["comparison"]))
        if row is not None:
            pse, slope = self._at(float(row.get(LEVEL, 0.0)))
            felt = _normal(slope * (float(row[self._axis]) - pse))
            return GUESSED + (1.0 - GUESSED) * felt if self._guesses else felt
        if not self._axis:
            return self.truth["judged_more"]
        if not trial.correct:
            return float(self.protocol.stimuli[name].peak_m_s2() != 0.0)
        is_chosen = trial.correct in (YES, trial.facts.get("comparison_at"))
        return float(is_chosen != (trial.facts.get("judged_more") == "not chosen"))

    def _at(self, level: float) -> tuple[float, float]:
        """Return PSE and slope at a level in m/s^2, in the unit of the axis."""
        if self._judges_level:
            standard = self._standard
            pse = self.protocol.stimuli[standard].peak_m_s2() if standard else self.truth["threshold_m_s2"]
            pse = max(pse or 0.0, 1e-3)  # that of a standard may not be known
            at, above = (self._on_axis(one) for one in (pse, pse * (1.0 + self.truth["level_spread"])))
            return at, 1.0 / (above - at)
        if self._axis != _STIFFNESS:
            numbers = [float(row[self._axis]) for row in self._places.values()]
            way = max(numbers) - min(numbers)
            return min(numbers) + self.truth["pse_share"] * way, 1.0 / (self.truth["pse_spread"] * way)
        pses = [self.truth[name] for name in _OF_STIFFNESS[:3]]
        return float(np.interp(level, thesis.LEVELS_M_S2, pses)), self.truth["slope_1" if level else "slope_0"]

    @property
    def _standard(self) -> str:
        """The standard that levels are compared with; "" where they are to be felt."""
        return "" if self._guesses else str(self.given["standard"])

    @property
    def _guesses(self) -> bool:
        """Whether a level is to be found beside silence, and what is not felt is guessed."""
        return self._judges_level and is_silent(self.given, self.protocol.stimuli)

    def _on_axis(self, level: float) -> float:
        """Return a level in the unit of the axis: a line through the logarithms of the two stimuli around it."""
        if self._axis == LEVEL:
            return level
        rows = self._places.values()
        least = 0.1 * min(row[LEVEL] for row in rows if row.get(LEVEL))  # what stands for no vibration
        known = sorted({(max(float(row.get(LEVEL, 0.0)), least), float(row[self._axis])) for row in rows})
        k = min(max(sum(one < level for one, _ in known), 1), len(known) - 1)
        (low, a), (high, b) = known[k - 1], known[k]
        return a + (b - a) * math.log(level / low) / math.log(high / low)


_STIFFNESS = "stiffness_n_mm"
_OF_STIFFNESS = ("pse_0", "pse_half", "pse_full", "slope_0", "slope_1")
"""What is true of comparisons of stiffness, with vibration and without."""


class MagnitudeEstimator(Observer):
    """Gives numbers in proportion to a power of the level, with a modulus of the person's own.

    Where all have one level, it is a power of the number that differs, such as stiffness.
    """

    methods = ("magnitude-estimation",)
    exponent = Number(0.6, -5.0, 5.0, doc="Of the power law of magnitude over level; of one level, over the number.")
    numbers_spread = Number(0.2, 0.0, 3.0, doc="Standard deviation of a number's logarithm from trial to trial.")
    moduli_differ = Number(1.0, 0.0, 5.0, doc="Standard deviation of the modulus's logarithm from person to person.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        modulus = 10.0 * math.exp(self.truth["moduli_differ"] * self.place)
        noise = math.exp(self.truth["numbers_spread"] * random.standard_normal())
        return {"magnitude": min(max(modulus * noise * self._magnitudes[trial.intervals[-1].stimulus], 1e-6), 1e6)}

    def truths(self) -> dict[str, float]:
        """Return what the analysis finds where every answer is the true magnitude."""
        felt = rows_of_stimuli(self.protocol, self.given["estimated"])
        rows = [{**row, "magnitude": self._magnitudes[row["stimulus"]]} for row in felt]
        return {one.name: one.value for one in magnitudes.estimates(rows, Settings())}

    @cached_property
    def _magnitudes(self) -> dict[str, float]:
        rows = rows_of_stimuli(self.protocol, self.given["estimated"])
        ratios = ratios_of(rows) or {row["stimulus"]: max(row.get(LEVEL, 0.0), 0.01) for row in rows}
        return {name: ratio ** self.truth["exponent"] for name, ratio in ratios.items()}


class Labeller(Observer):
    """Gives a label of the first sort at a rate that depends on the set, and otherwise of the last sort."""

    methods = ("free-labels",)
    impact_share_it = Number(thesis.IMPACT_LABELS["IT"], 0.0, 1.0, doc="Share of impact labels for the set IT.")
    impact_share_ws = Number(thesis.IMPACT_LABELS["WS"], 0.0, 1.0, doc="The same for the set WS.")
    labels_differ = Number(0.3, 0.0, 3.0, doc="Standard deviation of shares from person to person, in logits.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        of_it = self.protocol.stimuli[trial.intervals[0].stimulus].factors.get("set") == "IT"
        first = random.random() < self._share("impact_share_it" if of_it else "impact_share_ws")
        sorts = sorts_of(self.given) or ("knock", "hum")
        return {"label": sorts[0 if first else -1]}

    def truths(self) -> dict[str, float]:
        sorts = sorts_of(self.given)
        shares = {"IT": self._share("impact_share_it"), "WS": self._share("impact_share_ws")}
        return {f"{sorts[0]} {name}": share for name, share in shares.items()} if sorts else {}

    def _share(self, name: str) -> float:
        return _moved(self.truth[name], self.truth["labels_differ"] * self.place)


class FootSelector(Observer):
    """Presses a button with a normally distributed error in x and y, after some time."""

    methods = ("target-selection",)
    error_m = Number(0.03, 0.001, 1.0, doc="Standard deviation of where the centroid is, in x and in y.", unit="m")
    errors_differ = Number(0.15, 0.0, 1.0, doc="Standard deviation from person to person of the error's logarithm.")
    reach_s = Number(0.9, 0.1, 10.0, doc="Mean time to the press.", unit="s")
    reach_spread_s = Number(0.15, 0.0, 2.0, doc="Its standard deviation.", unit="s")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        place = self._error_m * random.standard_normal(2)
        time = self.truth["reach_s"] + self.truth["reach_spread_s"] * random.standard_normal()
        longest = self.given["visible_s"]
        inside = float(np.hypot(*place)) <= 0.5 * float(trial.facts["width_m"]) and time <= longest
        return {"selected": YES if inside else NO, "time_s": float(max(time, 0.0)) if inside else longest}

    def truths(self) -> dict[str, float]:
        """Return rates by Rayleigh's distribution; the small share of presses that come too late is neglected."""
        late = 1.0 - _normal(
            (self.given["visible_s"] - self.truth["reach_s"]) / max(self.truth["reach_spread_s"], 1e-9)
        )
        rates = {
            width: (1.0 - math.exp(-0.125 * (width / self._error_m) ** 2)) * (1.0 - late)
            for width in self.given["widths_m"]
        }
        found = {f"rate at {100.0 * width:g} cm": rate for width, rate in rates.items()}
        return {"rate": sum(rates.values()) / len(rates), "time": self.truth["reach_s"], **found}

    @property
    def _error_m(self) -> float:
        return float(self.truth["error_m"] * math.exp(self.truth["errors_differ"] * self.place))


OBSERVERS: Mapping[str, type[Observer]] = {
    kind: observer
    for observer in (
        Identifier,
        Detector,
        SlopedDetector,
        Adjuster,
        Discriminator,
        Rater,
        MagnitudeEstimator,
        PairJudge,
        Labeller,
        FootSelector,
    )
    for kind in observer.methods
}
"""The observer of each method by its kind."""


def truths_of(protocol: Protocol, truth: Mapping[str, float]) -> dict[str, tuple[Parameter, float]]:
    """Return the parameters that the answers to a protocol depend on, with their true values, by name.

    Practice is in no estimate. Raises `BadValue` for another name in `truth`, or a value out of range.
    """
    stages = [(stage, stage.method) for stage in protocol.stages if not stage.practice]
    made = [OBSERVERS[use.kind](truth, protocol, stage) for stage, use in stages if use is not None]
    known = {name: (one.parameters[name], one.truth[name]) for one in made for name in one.used()}
    for name in truth:
        choice("truth", name, known)
    return known


class SimulatedParticipant:
    """Answers all pages of a study: trials by its observers, other pages with their defaults."""

    def __init__(self, protocol: Protocol, truth: Mapping[str, float], random: np.random.Generator) -> None:
        self._random = random
        place = float(random.standard_normal())
        self.observers = {
            stage.id: OBSERVERS[stage.method.kind](truth, protocol, stage, place)
            for stage in protocol.stages
            if stage.method is not None
        }

    def answer(self, page: Page) -> Answers:
        """Return the answers to a page."""
        if page.kind == "consent":
            return {"agreed": YES}
        if page.trial is not None:
            return self.observers[page.stage].answer(page.trial, self._random)
        return {question.name: question.default for question in page.questions}


def _moved(share: float, logits: float) -> float:
    """Return a share increased by `logits`; 0 and 1 stay.

    >>> round(_moved(0.5, 1.0), 3), _moved(1.0, -2.0)
    (0.731, 1.0)
    """
    return share / (share + (1.0 - share) * math.exp(-logits))


def _normal(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def _normal_inverse(share: float) -> float:
    from statistics import NormalDist

    return NormalDist().inv_cdf(share)
