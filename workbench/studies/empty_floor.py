"""A warning for the experimenter if a key starts a presentation while nobody stands on the floor."""

from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner


def empty_floor_text(runner: Runner) -> str:
    """Return a warning if nobody stands on the floor before or during a presentation started by a key; else "".

    The trial is kept as it is, with its load: who feels it with a hand may load the floor with less than a foot.
    Before a presentation it is not said of the simulated floor, on which a foot comes by itself.
    """
    page, is_simulated = runner.page, runner.session.target.kind == "simulator"
    presents = page.trial is not None and page.start == "key" and bool(page.trial.intervals)
    is_felt = runner.phase is Phase.PRESENTING or runner.adjusting is not None
    awaited = is_felt or (runner.phase is Phase.READY and not is_simulated)
    if not presents or not awaited or runner.watch.is_loaded:
        return ""
    return f"Nobody stands on the floor: {abs(float(runner.watch.loads_n.sum())):.0f} N."
