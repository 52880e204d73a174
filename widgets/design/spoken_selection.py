"""What a screen reader says of the canvas."""

from underfoot.quantities import counted
from underfoot.widgets.design.scene import PatchScene


def spoken_selection(scene: PatchScene) -> str:
    """Return what a screen reader says of the selection: names, and the neighbours of a single node."""
    chosen = scene.selected()
    if len(chosen) != 1:
        return f"{counted(len(chosen), 'item')} selected" if chosen else "Nothing selected"
    if chosen[0] in scene.notes:
        return f"Note: {scene.notes[chosen[0]].note.text}"
    item = scene.nodes.get(chosen[0]) or scene.group_nodes[chosen[0]]
    sources = dict.fromkeys(wire.source.description.title for wire in item.wires if wire.source not in (item, None))
    targets = dict.fromkeys(wire.target.description.title for wire in item.wires if wire.target not in (item, None))
    words = ((sources, "from"), (targets, "to"))
    return ", ".join([item.description.title, *(f"{word} {' and '.join(names)}" for names, word in words if names)])
