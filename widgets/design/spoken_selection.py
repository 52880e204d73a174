"""What a screen reader says of the canvas."""

from underfoot.quantities import counted
from underfoot.widgets.design.scene import PatchScene


def spoken_selection(scene: PatchScene, at: str = "") -> str:
    """Return what a screen reader says of the selection: the name and neighbours of a single item, or of the one `at`
    which keys are.
    """
    chosen = scene.selected()
    count = f"{counted(len(chosen), 'item')} selected" if chosen else "Nothing selected"
    if at in chosen and len(chosen) > 1:
        return f"{_spoken(scene, at)}; {count}"
    return _spoken(scene, chosen[0]) if len(chosen) == 1 else count


def _spoken(scene: PatchScene, id: str) -> str:
    if id in scene.notes:
        return f"Note: {scene.notes[id].note.text}"
    item = scene.nodes.get(id) or scene.group_nodes[id]
    sources = dict.fromkeys(wire.source.description.title for wire in item.wires if wire.source not in (item, None))
    targets = dict.fromkeys(wire.target.description.title for wire in item.wires if wire.target not in (item, None))
    words = ((sources, "from"), (targets, "to"))
    return ", ".join([item.description.title, *(f"{word} {' and '.join(names)}" for names, word in words if names)])
