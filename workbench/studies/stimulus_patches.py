"""The patches of a study's stimuli at one participant's levels."""

from pathlib import Path

from underfoot.errors import require
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import Adjusted
from underfoot.experiments.stimuli import SILENT
from underfoot.experiments.trials import NOTHING, Presentation
from underfoot.patch.effective import effective_patch
from underfoot.patch.file_paths import files_of
from underfoot.patch.node import installed_nodes
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import downstream, node_id, port_name


class StimulusPatches:
    """The patches of a protocol's stimuli as they are in `folder` now: what is saved there later changes no trial."""

    def __init__(self, protocol: Protocol, folder: Path | None) -> None:
        self.protocol = protocol
        self._loaded = {name: one.loaded(folder) for name, one in protocol.stimuli.items()}

    def presented(self, presentation: Presentation, gain_db: float) -> Patch:
        """Return the patch of a presentation, with the participant's `gain_db`; raise `BadValue` beyond the limit."""
        if presentation.stimulus == NOTHING:
            return SILENT
        stimulus = self.protocol.stimuli[presentation.stimulus]
        total_db = presentation.gain_db + gain_db
        peak, limit = stimulus.peak_m_s2(total_db) or 0.0, self.protocol.limit_m_s2
        require(peak <= limit * (1.0 + 1e-9), presentation.stimulus, round(peak, 3), f"up to {limit:g} m/s^2")
        return self.at(presentation.stimulus, total_db)

    def at(self, stimulus: str, gain_db: float) -> Patch:
        """Return the patch of a stimulus at `gain_db` re the protocol's level."""
        return self.protocol.stimuli[stimulus].scaled(self._loaded[stimulus], gain_db)

    def adjusted(self, stimulus: str, question: Adjusted, value: float, gain_db: float) -> Patch:
        """Return the patch of a stimulus of which a participant has moved to `value` what the question says."""
        if not question.moves:
            return self.presented(Presentation(stimulus, value), gain_db)
        node, _, parameter = question.moves.partition(".")
        return self.presented(Presentation(stimulus), gain_db).set(node, parameter, value)

    def kinds(self) -> list[Patch]:
        """Return one patch for each distinct program, and sound file, of the stimuli."""
        found: dict[tuple[object, ...], Patch] = {}
        patches = [self.at(name, 0.0) for name in self.protocol.stimuli]
        for patch in (SILENT, *patches) if patches else ():
            nodes = tuple((node.id, node.type) for node in patch.nodes)
            files = tuple(files_of(patch, installed_nodes()))
            found.setdefault((nodes, patch.wires, files), patch)
        return list(found.values())


def unheard(patch: Patch) -> tuple[Patch, tuple[str, ...]]:
    """Return what of a patch runs before it is heard, and the outputs for which it does: all that follows the force.

    Outputs are left out, and what events start: it begins with the presentation.
    """
    patch = effective_patch(patch, installed_nodes())
    types = patch.node_types(installed_nodes())
    events = [w for w in patch.wires if types[node_id(w[0])].output_ports[port_name(w[0])].kind == "event"]
    sinks = {id for id, type in types.items() if type.is_sink}
    left_out = downstream(patch.wires, sinks | {node_id(target) for _, target in events})
    ends = (source for source, target in patch.wires if node_id(target) in left_out and node_id(source) not in left_out)
    return patch.remove(left_out), tuple(dict.fromkeys(ends))
