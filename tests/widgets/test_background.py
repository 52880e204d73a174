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
        worker.compute(lambda task: done.append("opened again") or ["port"], done.append)
        answers.set()
    worker.join()
    assert done == ["opened", "closed", "opened again"]
