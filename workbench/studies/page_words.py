"""What a participant reads on a page of a study, beside its questions: in the window, and in a terminal.

It is in the study's language; what is passed to `say` is English.
"""

from underfoot.experiments.questions import Adjusted
from underfoot.parameters import Count, Parameter, ask
from underfoot.phrases import Phrase
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner
from underfoot.studies.simulated_foot import may_step


def title_of(runner: Runner) -> str:
    """Return the title of the page, or which of two intervals comes; "" where the question says it."""
    page, say = runner.page, runner.language.say
    if runner.phase is Phase.PREPARING:
        return say("One moment")
    if runner.phase is Phase.STOPPED:
        return say("Stopped")
    if runner.adjusting is not None and (title := _title_of_adjusting(runner.adjusting)):
        return say(title)
    if page.trial is None:
        return say(page.title)
    if runner.phase is Phase.ANSWERING:
        return ""
    title = page.title
    if len(page.trial.intervals) > 1 and not isinstance(page.questions[0], Adjusted):
        title = "First one" if runner.interval == 1 else "Second one"
    elif page.trial.facts.get("announced"):
        title = "Nothing comes this time"
    practice, title = say("Practice"), say(title)
    if not page.practice or practice.casefold() in title.casefold():
        return title
    return say(Phrase("Practice: {title}", title=title)) if title else practice


def _title_of_adjusting(adjusting: Adjusting) -> str:
    """Return in English which one is felt, where there is a standard, and whether what is moved has come to an end."""
    if adjusting.is_held:
        return "It goes no further"
    if adjusting.standard is None:
        return ""
    return "The one to compare with" if adjusting.is_at_standard else "The one to set"


def text_of(runner: Runner) -> str:
    """Return the text of the page; before a trial the feedback on the one before, or else the stage's text.

    Before its second interval it has none: "the last one" would be the first interval.
    """
    page, say = runner.page, runner.language.say
    last = say(page.feedback)
    match runner.phase:
        case Phase.PREPARING | Phase.STOPPED | Phase.PRESENTING | Phase.ANSWERING:
            return ""
        case Phase.WAITING | Phase.READY:
            return (last or page.text) if runner.interval == 1 else ""
    right = _right_answers(runner) if page.kind == "learn" else ""
    return "\n\n".join(part for part in (last, say(page.text), right) if part)


def questions_of(runner: Runner) -> tuple[Parameter, ...]:
    """Return the questions of the page; in learning which stimulus is to be felt, by number: its name could tell."""
    if runner.page.kind == "learn":
        return (ask("number", Count(1, 1, len(runner.study.learnable), doc="Which one do you want to feel?")),)
    return runner.page.questions


def hint_of(runner: Runner, steps: str) -> str:
    """Return what the participant is to do now; `steps` says what steps on a simulated floor, where that is awaited."""
    is_awaited = may_step(runner) and runner.adjusting is None  # where something is moved, the page says what to do
    hints = (runner.hint, steps if is_awaited else "")
    return " ".join(runner.language.say(hint) for hint in hints if hint)


def _right_answers(runner: Runner) -> str:
    """Return the right answers by stimulus number in learning, if the stimuli have them."""
    say, answers = runner.language.say, runner.study.learnable_answers
    return ",  ".join(f"{number}: {say(word)}" for number, word in answers.items())
