"""Computations in a thread: what is stopped is discarded before the next one opens the same thing."""

import threading

from underfoot.widgets.background import BackgroundWorker


def test_what_is_stopped_is_closed_before_it_is_opened_again(qtbot):
    """A study that was begun again right after Stop found the port taken, by what it had opened itself."""
    worker, answers, done = BackgroundWorker(), threading.Event(), []

    def first(task):
        answers.wait()
        done.append("opened")
        return ["port"]

    worker.compute(first, lambda one: done.append("closed"))
    worker.stop()
    with qtbot.waitSignal(worker.found):
        worker.compute(lambda task: done.append("opened again") or ["port"])
        answers.set()
    assert done == ["opened", "closed", "opened again"]


def test_what_is_on_its_way_to_the_window_when_it_is_stopped_is_not_told(qtbot):
    """Steps of recordings that were left came, and others were looked for, while those that were chosen were read."""
    worker, told = BackgroundWorker(), []
    worker.found.connect(told.extend)
    worker.failed.connect(told.append)
    worker.compute(lambda task: ["port"], lambda one: told.append(f"{one} closed"))
    worker.join()
    worker.stop()
    qtbot.waitUntil(lambda: len(told) > 1)
    assert told == ["Stopped.", "port closed"]
