"""What a participant reads on a page of a study, beside its questions: in the window, and in a terminal."""

from underfoot.experiments.questions import Adjusted
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner

_PRACTICE = "Practice"


def title_of(runner: Runner) -> str:
    """Return the title of the page, or which of two intervals comes; "" where the question says it."""
    page = runner.page
    if runner.phase is Phase.PREPARING:
        return "One moment"
    if runner.phase is Phase.STOPPED:
        return "Stopped"
    if runner.adjusting is not None and (title := _title_of_adjusting(runner.adjusting)):
        return title
    if page.trial is None:
        return page.title
    if runner.phase is Phase.ANSWERING:
        return ""
    title = page.title
    if len(page.trial.intervals) > 1 and not isinstance(page.questions[0], Adjusted):
        title = f"{'First' if runner.interval == 1 else 'Second'} one"
    elif page.trial.facts.get("announced"):
        title = "Nothing comes this time"
    is_said = not page.practice or _PRACTICE.casefold() in title.casefold()
    return title if is_said else ": ".join(filter(None, (_PRACTICE, title)))


def _title_of_adjusting(adjusting: Adjusting) -> str:
    """Return which one is felt, where there is a standard, and whether what is moved has come to an end."""
    if adjusting.is_held:
        return "It goes no further"
    if adjusting.standard is None:
        return ""
    return "The one to compare with" if adjusting.is_at_standard else "The one to set"


def text_of(runner: Runner) -> str:
    """Return the text of the page; before a trial the feedback on the one before, or else the stage's text.

    Before its second interval it has none: "the last one" would be the first interval.
    """
    page = runner.page
    last = f"The last one: {page.feedback[0].lower()}{page.feedback[1:]}" if page.feedback else ""
    match runner.phase:
        case Phase.PREPARING | Phase.STOPPED | Phase.PRESENTING | Phase.ANSWERING:
            return ""
        case Phase.WAITING | Phase.READY:
            return (last or page.text) if runner.interval == 1 else ""
    right = _right_answers(runner) if page.kind == "learn" else ""
    return "\n\n".join(part for part in (last, page.text, right) if part)


def _right_answers(runner: Runner) -> str:
    """Return the right answers by stimulus number in learning, if the stimuli have them."""
    words = [runner.protocol.stimuli[name].correct for name in runner.study.learnable]
    return ",  ".join(f"{number}: {word}" for number, word in enumerate(words, 1) if word)
