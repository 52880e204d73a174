"""`underfoot cost`: where a block's time goes for one patch on one floor."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import interrupted_by_signals
from underfoot.commands.files import RUN_CODE
from underfoot.commands.options import FIGURES_AS_JSON, command, require_only
from underfoot.errors import BadValue
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.bench.block_stages import BlockStages
    from underfoot.patch.patch import Patch


@dataclass(frozen=True)
class CostOptions:
    """Options of the command; None if not given."""

    patch: Path = argument("patches")
    floor: Path | None = option("Floor JSON; by default four tiles.", presets="floors")
    feet: int | None = option("Number of tiles with a foot that steps once a second; by default all.")
    block: int = option("Frames per block.", 1024)
    profiles: Path | None = option("Folder of the tiles' profiles: equalisers, sensor curves.")
    simulated: bool = option("Include the plates of a simulated floor, as in a session on one.", False)
    outside_files: bool = option("Let the patch read sound files outside its own folder.", False)
    run_code: bool = shared(RUN_CODE)
    curve: str | None = option("Plot run time against error of this node only.", metavar="NODE")
    as_json: bool = shared(FIGURES_AS_JSON)


@command(CostOptions)
def cost(options: CostOptions) -> None:
    """Measure the run time of each stage and node of PATCH, and when nodes sleep.

    With --curve, what a node takes at several requested errors, and which errors come of them: measured in this
    process, and kept until node or code changes.
    """
    from underfoot.bench.block_stages import block_stages
    from underfoot.floor.layout import Floor, default_floor
    from underfoot.nodes import REGISTRY
    from underfoot.patch.outside_files import require_inside
    from underfoot.patch.patch import Patch

    patch = Patch.load(options.patch, REGISTRY)
    if not options.outside_files:
        require_inside(patch, REGISTRY, options.patch)
    if options.curve is not None:
        require_only(options, "--curve", "--outside-files --run-code --json")
        _print_error_curve(patch, options.curve, options.as_json)
        return
    floor = Floor.load(options.floor) if options.floor else default_floor()
    with interrupted_by_signals(), report_compiling():
        found = block_stages(
            patch,
            floor,
            feet=len(floor.tiles) if options.feet is None else options.feet,
            block=options.block,
            profiles=options.profiles,
            folder=options.patch.parent,
            simulated=options.simulated,
        )
    print(json.dumps(asdict(found)) if options.as_json else "\n".join(_lines(found)))


def _print_error_curve(patch: "Patch", node: str, as_json: bool) -> None:
    """Measure a node as its patch has it built, and print each point as soon as it is known."""
    from underfoot.engine.error_curve import error_curve
    from underfoot.nodes import REGISTRY
    from underfoot.patch.effective import effective_patch

    built = effective_patch(patch, REGISTRY)
    placed = built.node(node)
    measured = [one.id for one in built.nodes if REGISTRY[one.type].requested_error is not None]
    if node not in measured:
        allowed = f"allowed: {', '.join(measured)}" if measured else "no node of the patch has a requested error"
        raise BadValue(f"--curve is {node}, which is {REGISTRY[placed.type].accuracy}; {allowed}")
    with interrupted_by_signals(), report_compiling():
        for curve in error_curve(REGISTRY[placed.type], placed.parameters):
            if as_json:
                continue
            if curve.points:
                point = curve.points[-1]
                print(f"  {point.asked:10.1e} {point.found:10.1e} {point.ms:11.4f}", flush=True)
            else:
                print(
                    f"{node} stands here: {curve.description()}",
                    f"{'requested':>12} {'found':>10} {'ms':>11}",
                    sep="\n",
                )
    if as_json:
        print(json.dumps(curve.data()))


def _lines(found: "BlockStages") -> list[str]:
    from underfoot.bench.block_stages import STAGES

    lines = [
        f"{found.tiles} tiles, a foot on {found.stood_on}, block {found.block}: {found.whole_ms:.3f} ms a second of "
        f"sound, {1e3 / found.whole_ms:.1f} times real time"
    ]
    for stage in found.stages:
        share = 100.0 * stage.ms / found.whole_ms
        lines.append(f"  {stage.stage:18} {stage.ms:9.3f} ms {share:5.1f} %   {STAGES[stage.stage]}")
    lines.append(f"beside it, where devices are read: {found.reading_ms:.3f} ms to turn readings into newtons")
    lines.append("nodes")
    for node in sorted(found.nodes, key=lambda node: -node.ms):
        share = 100.0 * node.ms / found.whole_ms
        sleeps = f"sleeps when {node.sleeps}" if node.sleeps else "never sleeps"
        awake = f"awake on {node.tiles_awake:.1f} of {found.tiles}"
        lines.append(f"  {node.node:18} {node.ms:9.3f} ms {share:5.1f} %   {node.type}, {awake}; {sleeps}")
    if found.left_out:
        lines.append(f"left out, as no output needs them: {', '.join(found.left_out)}")
    return lines
