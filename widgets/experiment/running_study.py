"""A running study: the runner, the experimenter's view, and the participant's window."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QGuiApplication

from underfoot.engine.commands import PressTile, Walk
from underfoot.engine.reports import Report, SensorFaults
from underfoot.errors import BadFile, UnderfootError
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.store import SessionFile
from underfoot.files import remove_file
from underfoot.studies.equipment import Equipment, EquipmentChoice
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner
from underfoot.studies.simulated_foot import SimulatedFoot, may_step
from underfoot.studies.target import StandingPlace
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.controls.question import ask
from underfoot.widgets.experiment.experimenter_view import ExperimenterView
from underfoot.widgets.experiment.findings import answers_so_far
from underfoot.widgets.experiment.participant_window import ParticipantWindow
from underfoot.widgets.experiment.studies import StudyFile
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.footstep_tracker import load_tracking

MIN_ANSWERS = 4
"""Smallest number of trials for a drawing of the results during a study."""


class RunningStudy(QObject):
    """Runs one study at a time on the window's session, and draws what the answers so far say."""

    notified = Signal(str)
    begun = Signal()
    """The equipment is open, and the study runs."""
    failed = Signal(str)
    """No session has begun; carries the reason, or "" where it was said."""
    ended = Signal(object, str)
    """The session has ended; carries the `StudyFile`, and the id of a participant who has finished it, or ""."""

    def __init__(self, experimenter: ExperimenterView) -> None:
        super().__init__(experimenter)
        self.experimenter = experimenter
        self.background, self.opener = BackgroundWorker(self), BackgroundWorker(self)
        self._waiting: _Waiting | None = None
        self.runner: Runner | None = None
        self.window_of_participant: ParticipantWindow | None = None
        self._controller: SessionController | None = None
        self._study: StudyFile | None = None
        self._walked, self._drawn = False, 0
        self._foot = SimulatedFoot()
        self._connect()

    @property
    def is_on(self) -> bool:
        """Whether a study is running, or its equipment is being opened."""
        return self.runner is not None or self._waiting is not None

    @property
    def has_participant(self) -> bool:
        """Whether a participant is in an unfinished session; a pilot does not count."""
        is_pilot = self._study is not None and self._study.is_pilot
        return self.runner is not None and not is_pilot and not self.runner.study.has_all_answers

    def begin(
        self, controller: SessionController, study: StudyFile, participant: str, path: Path, choice: EquipmentChoice
    ) -> None:
        """Begin a participant's session in the file `path`, or continue it as begun; `begun` or `failed` follows.

        The equipment is opened and kernels are loaded in a thread, until `leave`: a sound server may hang.

        The window's session is lent meanwhile, and says so if something else has it.
        """
        session = controller.lend()
        if session is None:
            self.failed.emit("")
            return
        try:
            with ExitStack() as unless_begun:
                unless_begun.callback(controller.take_back)
                if path.exists():
                    file = SessionFile.open(path)
                else:
                    file = SessionFile.create(path, study.protocol, participant, study.folder)
                    unless_begun.callback(remove_file, path)
                unless_begun.callback(file.close)
                if file.participant != participant:  # as where folders of two computers were put together
                    other = f"{path} is the session of {file.participant}, not of {participant}"
                    raise BadFile(f"{other}; rename the file, or type another id")
                file.hold()  # before equipment is opened, which another window may use with this session
                protocol, folder = file.as_begun(study.folder)
                controller.is_blind = protocol.double_blind
                run = partial(Runner, session, file, protocol, folder)
                self._waiting = _Waiting(controller, study, run, unless_begun.pop_all())
        except UnderfootError as error:
            self.failed.emit(str(error))
            return
        sounds, floor, force_hz = protocol.sounds, session.target.floor, session.force_rate_hz

        def open_all(_: Task) -> list[Equipment]:
            load_tracking()  # of which the window's thread would wait for what the engine has not compiled yet
            return [choice.opened(sounds, floor, force_hz)]

        self.opener.compute(open_all, Equipment.close)

    def _run(self, opened: Sequence[Equipment]) -> None:
        """Run the study that waits for its equipment."""
        (equipment,) = opened
        waiting, self._waiting = self._waiting, None
        assert waiting is not None
        try:
            with waiting.unless_begun as unless_begun:
                unless_begun.callback(equipment.close)
                self.runner = waiting.run(equipment)
                unless_begun.pop_all()
        except UnderfootError as error:
            self.failed.emit(str(error))
            return
        session = self.runner.session
        self._controller, self._study = waiting.controller, waiting.study
        self._walked, self._drawn = session.target.walker, 0
        session.send(Walk(False))
        self.experimenter.begin(self.runner, waiting.study.name)
        self.begun.emit()

    def _give_up(self, why: str) -> None:
        """Begin no session."""
        if self._waiting is not None:
            self._waiting.unless_begun.close()
            self._waiting = None
            self.failed.emit(why)

    def stop(self, why: str) -> None:
        """Silence the output; the current presentation begins again on continuation. Nothing begins after it."""
        self.opener.stop()
        self._do(lambda runner: runner.stop(why))

    def show_participant(self) -> None:
        """Open the participant's window on the last of the other screens, or beside this window."""
        if self.runner is None:
            return
        if self.window_of_participant is None:
            made = ParticipantWindow(StandingPlace.of(self.runner.protocol))
            made.answered.connect(self._answer)
            made.stepped.connect(self._step)
            made.continue_requested.connect(self._go)
            made.stop_requested.connect(lambda: self._do(lambda runner: runner.stop("by the participant")))
            made.closed.connect(self._window_closed)
            self.window_of_participant = made
        others = [screen for screen in QGuiApplication.screens() if screen is not self.experimenter.screen()]
        if others:
            self.window_of_participant.show_on(others[-1])
        else:
            self.window_of_participant.resize(1000, 700)
            self.window_of_participant.show()
            self.window_of_participant.activateWindow()
        self.window_of_participant.show_runner(self.runner)

    def unwritten(self) -> str:
        """Write an answer that the disk has refused; return why it still does, or "" if there is none to be lost."""
        try:
            if self.runner is not None:
                self.runner.file.write_waiting()
        except UnderfootError as error:
            return str(error)
        return ""

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Call `then`; ask before where an answer would be lost, since the disk refuses it."""
        if why := self.unwritten():
            text = f"{why}. The last answer is lost if the study is left now."
            ask(self.experimenter.window(), "An answer is not written", text, "Leave without it", then, "Stay")
        else:
            then()

    def leave(self) -> None:
        """End the session for now, or do not begin it; it can be continued later."""
        self.opener.stop()
        runner, self.runner = self.runner, None
        self.background.stop()
        if self.window_of_participant is not None:
            self.window_of_participant.close()
        if runner is None or self._controller is None:
            return
        if self._controller.session is not None:
            self._foot.leave(runner)
            runner.session.send(Walk(self._walked))
        try:
            runner.close_file()
        except UnderfootError as error:
            self.notified.emit(str(error))
        self._controller.take_back()
        self.ended.emit(self._study, runner.study.participant if runner.study.has_all_answers else "")

    def take(self, reports: list[Report]) -> None:
        """Pass the session's reports to the runner, and show faulty sensors."""
        if self.runner is None:
            return
        self._do(lambda runner: runner.poll(reports))
        for report in reports:
            if isinstance(report, SensorFaults):
                self.experimenter.map.set_faults(report.faults)

    def tick(self) -> None:
        """Advance the study, and show its state."""
        if self.runner is None:
            return
        self._do(lambda runner: runner.poll(()))
        self._foot.tick(self.runner)
        self.experimenter.show_runner(self.runner)
        self._draw_answers(self.runner)
        if self.window_of_participant is not None:
            self.window_of_participant.show_runner(self.runner)

    def _draw_answers(self, runner: Runner) -> None:
        """Analyse the answers in a thread after each new answer."""
        study, entries = runner.study, list(runner.study.entries)
        answered = sum(entry.trial is not None and not entry.spoiled for entry in entries)
        if study.protocol.double_blind or answered < MIN_ANSWERS or answered == self._drawn or self.background.is_busy:
            return
        self._drawn = answered
        self.background.compute(lambda _: answers_so_far(study.protocol, study.participant, entries))

    def _show_findings(self, findings: Sequence[Findings], why_not: str = "") -> None:
        """Show drawings of the answers so far, or why there are none."""
        self.experimenter.drawings.show_drawings([one for found in findings for one in found.drawings], why_not)

    def _do(self, what: Callable[[Runner], object], note: str = "") -> None:
        """Do an action of the runner; show its error, if any, and again the `note` that it did not take."""
        if self.runner is None:
            return
        try:
            what(self.runner)
        except UnderfootError as error:
            self.notified.emit(str(error))
            if note:
                self.experimenter.note_field.setText(note)

    def _go(self) -> None:
        """Begin a presentation, or continue from a page without questions."""
        runner = self.runner
        if runner is None:
            return
        if runner.may_play or may_step(runner):
            if runner.may_play:
                self._do(lambda r: r.start())
            if may_step(runner):  # also onto what was played, while it is moved
                self._foot.step(runner)
        elif runner.phase is Phase.PAGE and not runner.page.questions:
            self._do(lambda r: r.answer({}))
        elif runner.phase is Phase.END:
            self.leave()

    def _answer(self, values: dict[str, Any]) -> None:
        if self.runner is not None and self.runner.page.kind == "learn":
            self._do(lambda runner: runner.play(runner.study.learnable[values["number"] - 1]))
        else:
            self._do(lambda runner: runner.answer(values))

    def _step(self, way: int, is_fine: bool) -> None:
        self._do(lambda runner: runner.adjust(way, is_fine=is_fine))

    def _press(self, tile: str, x_m: float, y_m: float, force_n: float) -> None:
        self._do(lambda runner: runner.session.send(PressTile(tile, x_m, y_m, force_n)))

    def _window_closed(self) -> None:
        self.window_of_participant = None
        if self.runner is not None:  # else the study is left
            self.notified.emit("The participant's window was closed; “Participant's window” opens it again.")

    def _connect(self) -> None:
        self.opener.found.connect(self._run)
        self.opener.failed.connect(self._give_up)
        self.background.found.connect(self._show_findings)
        self.background.failed.connect(lambda why: self._show_findings((), why))
        experimenter = self.experimenter
        experimenter.next_requested.connect(self._go)
        experimenter.end_pause_requested.connect(lambda: self._do(lambda runner: runner.end_pause()))
        experimenter.stop_requested.connect(lambda: self._do(lambda runner: runner.stop("by the experimenter")))
        experimenter.continue_requested.connect(lambda: self._do(lambda runner: runner.go_on()))
        experimenter.spoil_requested.connect(lambda why: self._do(lambda runner: runner.spoil(why)))
        experimenter.repeat_requested.connect(lambda why: self._do(lambda runner: runner.repeat_last(why), why))
        experimenter.note_given.connect(lambda text: self._do(lambda runner: runner.note(text), text))
        experimenter.window_requested.connect(self.show_participant)
        experimenter.leave_requested.connect(lambda: self.ask_to_leave(self.leave))
        experimenter.answered.connect(self._answer)
        experimenter.stepped.connect(self._step)
        experimenter.pressed.connect(self._press)


class _Waiting(NamedTuple):
    """A session that waits for its equipment: what runs it then, and what is undone if it does not begin."""

    controller: SessionController
    study: StudyFile
    run: Callable[[Equipment], Runner]
    unless_begun: ExitStack
