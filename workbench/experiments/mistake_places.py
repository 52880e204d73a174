"""The place of a mistake in a protocol in the words of its form: the stage, stimulus or question, and the field."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from underfoot.experiments.declared import fields_of, shown_name
from underfoot.experiments.foot import FootAnswer
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol, Sounds, Stage
from underfoot.experiments.questions import Question
from underfoot.experiments.stimuli import Stimulus
from underfoot.parameters import Parameter

_PLACED = re.compile(r"\$\.(?P<path>[^\s:;]+)(?P<says>.*)", re.DOTALL)
_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


def in_form(mistake: str, protocol: Mapping[str, Any]) -> str:
    """Return a mistake in the document `protocol`, as a file names it, with its place as the form names it.

    >>> raw = {"stages": [{"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {}}}]}
    >>> in_form("$.stages[0].method.parameters.blocks is 0; allowed: whole numbers 1 to 1000", raw)
    'Stage main, Blocks is 0; allowed: whole numbers 1 to 1000'
    >>> in_form("$.sounds.noise_db is 'loud'; allowed: a number", raw)
    "Sounds, Noise level is 'loud'; allowed: a number"
    """
    found = _PLACED.fullmatch(mistake)
    if found is None:
        return mistake
    steps = [name or int(number) for name, number in _STEP.findall(found["path"])]
    place = place_in_form(steps, protocol)
    return f"{place[:1].upper()}{place[1:]}{found['says']}"


def place_in_form(steps: Sequence[str | int], protocol: Mapping[str, Any]) -> str:
    """Return the place at the end of these keys of the document, in the words of the form.

    >>> place_in_form(["stages", 0, "seconds"], {"stages": [{"id": "rest", "kind": "pause"}]})
    'stage rest, Lasts'
    """
    return ", ".join(_names(steps, protocol))


def _names(steps: Sequence[str | int], protocol: Mapping[str, Any]) -> list[str]:
    match steps:
        case ["stages", int(at), *rest]:
            stage = _item(protocol["stages"], at)
            return [f"stage {stage.get('id') or at + 1}", *_in_stage(rest, stage)]
        case ["stimuli", str(name), *rest]:
            return [f"stimulus {name}", *_field(Stimulus, rest)]
        case ["participant", int(at), *rest]:
            return [_question(protocol["participant"], at), *_field(Question, rest)]
        case ["sounds", *rest]:
            return ["sounds", *_field(Sounds, rest)]
    return _field(Protocol, steps)


def _in_stage(steps: Sequence[str | int], stage: Mapping[str, Any]) -> list[str]:
    match steps:
        case ["questions", int(at), *rest]:
            return [_question(stage["questions"], at), *_field(Question, rest)]
        case ["foot", *rest]:
            return ["answer by foot", *_field(FootAnswer, rest)]
        case ["method", "parameters", str(name), *rest]:
            method = METHODS.get((stage.get("method") or {}).get("kind", ""))
            return [_shown(name, method.parameters if method else {}), *_plain(rest)]
    return _field(Stage, steps)


def _field(document: type[msgspec.Struct], steps: Sequence[str | int]) -> list[str]:
    """Return the captions of a field of a document, and of the values inside it."""
    if not steps:
        return []
    name = str(steps[0])
    return [_shown(name, fields_of(document, [name]) if name in document.__struct_fields__ else {}), *_plain(steps[1:])]


def _shown(name: str, parameters: Mapping[str, Parameter]) -> str:
    return shown_name(name, parameters.get(name))


def _plain(steps: Sequence[str | int]) -> list[str]:
    """Return steps of a path as text: indices count from 1; others are a patch's names, node.parameter."""
    numbers = [f"number {step + 1}" for step in steps if isinstance(step, int)]
    names = ".".join(step for step in steps if isinstance(step, str))
    return [*([names] if names else []), *numbers]


def _question(questions: Sequence[Mapping[str, Any]], at: int) -> str:
    return f"question {_item(questions, at).get('name') or at + 1}"


def _item(items: Sequence[Mapping[str, Any]], at: int) -> Mapping[str, Any]:
    return items[at] if at < len(items) else {}
