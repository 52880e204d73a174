"""Small protocols, and participants with known answers."""

import json

from underfoot.experiments.protocol import FORMAT, Protocol
from underfoot.patch import preset_files

TD = {"patch": "stimulus-td", "scaled_by": "gain.gain", "measured_m_s2": 6.8, "level_m_s2": 0.43}


def protocol_text(**changes):
    """Return a protocol of one stimulus and one stage of ratings, as JSON."""
    stage = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 2}}}
    fields = {"format": FORMAT, "version": 1, "stimuli": {"TD": TD, "X": {}}, "stages": [stage], **changes}
    return json.dumps(fields)


def made_protocol(kind, parameters=None, stimuli=None, **stage):
    """Return a checked protocol of one stage of trials of this method."""
    fields = {"id": "main", "kind": "trials", "method": {"kind": kind, "parameters": parameters or {}}, **stage}
    made = protocol_text(stages=[fields], stimuli=stimuli or {"TD": TD, "X": {}}, present_s=0.3)
    return Protocol.loads(made)


def preset_protocol(name):
    return Protocol.load(preset_files.protocols()[name])


def first_answers(page):
    """Answer a page with the defaults of its questions, and give consent."""
    return (
        {"agreed": "yes"}
        if page.kind == "consent"
        else {question.name: question.default for question in page.questions}
    )


def walked(study, answers=first_answers, most=10_000):
    """Return the pages of a study from its present one to its end, each answered by `answers(page)`."""
    pages = []
    while not study.is_done and len(pages) < most:
        pages.append(study.page)
        study.answer(answers(study.page))
    return pages


def trials(pages, stage="main"):
    return [page.trial for page in pages if page.trial is not None and page.stage == stage]
