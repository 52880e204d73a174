"""Free positions for new nodes, and automatic layout of a patch, in canvas pixels. Without Qt."""

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from statistics import fmean

import numpy as np

from underfoot.patch.wiring import reached
from underfoot.widgets.theme import GRID

Box = tuple[float, float, float, float]
"""Left, top, width, height."""

GAP = 2.0 * GRID
"""Distance between a node and a node placed beside it, in pixels."""

GAP_BESIDE = 3.0 * GRID
"""Distance between a node and its neighbours along a wire, in pixels: the wire is seen."""

FAR = 1e5
"""Further than any item, in pixels."""

COLUMN_GAP = 8.0 * GRID
SWEEPS = 8
LANE = 0.0, 6.0 * GRID
"""Size of the room for a wire in a column that it crosses: its ends are as far above the middles of their nodes."""
LANE_WEIGHT = 8.0
"""How much straighter a wire is along its lanes than between neighbours (Gansner et al. 1993, A technique for drawing
directed graphs)."""

NEAR_STEPS, FAR_STEPS, GRID_STEP = 24, 96, 2
"""Search range for a free place, near and far, and its step, in units of the grid."""


def shift_to_free_place(new: Sequence[Box], taken: Sequence[Box], avoided: Sequence[Box] = ()) -> tuple[float, float]:
    """Return the smallest shift, on the grid, with which no new box touches an existing one, nor, if there is such a
    shift, one of `avoided`.

    >>> shift_to_free_place([(0.0, 0.0, 100.0, 80.0)], [])
    (0.0, 0.0)
    >>> shift_to_free_place([(0.0, 0.0, 100.0, 80.0)], [(0.0, 48.0, 100.0, 80.0)])
    (0.0, -48.0)
    """
    if not new or not taken:
        return 0.0, 0.0
    for there in ([*taken, *avoided], taken):
        shift = _shift(new, np.array(there))
        if shift is not None:
            return shift
    below = max(top + height for _, top, _, height in taken) + GAP - min(box[1] for box in new)
    return 0.0, float(np.ceil(below / GRID) * GRID)


def _shift(new: Sequence[Box], there: np.ndarray) -> tuple[float, float] | None:
    for boxes, reach in ((np.array(new), NEAR_STEPS), (_bounding_box(new), FAR_STEPS)):
        shifts = _shifts(reach)
        for left, top, width, height in boxes:
            x, y = left + shifts[:, :1], top + shifts[:, 1:]
            beside = (x >= there[:, 0] + there[:, 2] + GAP) | (x + width + GAP <= there[:, 0])
            free = beside | (y >= there[:, 1] + there[:, 3] + GAP) | (y + height + GAP <= there[:, 1])
            shifts = shifts[free.all(axis=1)]
        if len(shifts):
            return float(shifts[0, 0]), float(shifts[0, 1])
    return None


def behind(frame: Box, stranger: Box, title: float) -> Box:
    """Return where something put into a frame would make it grow over a stranger: the place of the stranger, and all
    that lies behind it. `title` is the height of the frame's title.

    >>> behind((0.0, 0.0, 100.0, 80.0), (0.0, 120.0, 100.0, 80.0), 24.0) == (-FAR, 120.0, 2 * FAR, FAR)
    True
    """
    sides = []
    for i, margin in enumerate((0.0, title)):
        near, far = stranger[i], stranger[i] + stranger[2 + i]
        if near >= frame[i] + frame[2 + i]:
            sides.append((near, FAR))
        elif far <= frame[i]:
            sides.append((far + margin - FAR, FAR))
        else:
            sides.append((-FAR, 2 * FAR))
    (left, width), (top, height) = sides
    return left, top, width, height


def nearest(box: Box, boxes: Mapping[str, Box]) -> str:
    """Return the box to which the gap from a box is smallest, "" of none.

    >>> nearest((0.0, 120.0, 50.0, 30.0), {"a": (400.0, 120.0, 100.0, 80.0), "b": (0.0, 0.0, 100.0, 80.0)})
    'b'
    """

    def gap(other: Box) -> float:
        across, down = (max(other[i] - box[i] - box[2 + i], box[i] - other[i] - other[2 + i], 0.0) for i in (0, 1))
        return math.hypot(across, down)

    return min(boxes, key=lambda id: gap(boxes[id]), default="")


def backwards(box: Box, side: str) -> list[Box]:
    """Return where the wire of a new node would run backwards: left of its box if it comes from an output, "out", right
    of it if it goes to an input, "in".

    >>> backwards((64.0, 0.0, 96.0, 80.0), "out") == [(48.0 - FAR, -FAR, FAR, 2 * FAR)]
    True
    """
    left, _, width, _ = box
    begin = {"out": left - GAP - FAR, "in": left + width + GAP}
    return [(begin[side], -FAR, FAR, 2 * FAR)] if side else []


def outermost(frames: Mapping[str, tuple[Box, Collection[str]]], id: str, other: str) -> str:
    """Return the first of these frames that is around one item and not around the other; that item if none is.

    >>> frames = {"outer": ((0.0, 0.0, 400.0, 200.0), "ab"), "inner": ((0.0, 40.0, 200.0, 100.0), "a")}
    >>> outermost(frames, "a", "b"), outermost(frames, "b", "a")
    ('inner', 'b')
    """
    return next((frame for frame, (_, inside) in frames.items() if id in inside and other not in inside), id)


def pushed(
    boxes: Mapping[str, Box], frames: Mapping[str, tuple[Box, Collection[str]]], first: Iterable[str], by: float
) -> set[str]:
    """Return what moves `by` to the right if `first` does: that, and all that it would come to lie over, or that frames
    would, which grow around it. `frames` have their place and what is in them; one that is hit moves as a whole.

    >>> boxes = {id: (x, 0.0, 100.0, 80.0) for id, x in (("a", 0.0), ("b", 120.0), ("c", 400.0))}
    >>> sorted(pushed(boxes, {}, ["a"], 64.0)), sorted(pushed(boxes, {}, ["a"], 200.0))
    (['a', 'b'], ['a', 'b', 'c'])
    """
    there = {**boxes, **{id: box for id, (box, _) in frames.items()}}
    moving, waiting = set[str](), list(first)
    while waiting:
        id = waiting.pop()
        if id in moving:
            continue
        moving.add(id)
        for mover in (id, *(frame for frame, (_, inside) in frames.items() if id in inside)):
            left, top, width, height = there[mover]
            waiting += [
                other
                for other, (x, y, _, high) in there.items()
                if 0.0 <= x - left - width < by + GAP and y < top + height and top < y + high
            ]
        waiting += frames[id][1] if id in frames else ()
    return moving - frames.keys()


def framed_places(
    sizes: Mapping[str, tuple[float, float]],
    wires: Iterable[tuple[str, str]],
    frames: dict[str, list[str]],
    pads: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """Return positions as `layered_places` does, with all that is in a frame together, and nothing else there.

    `frames` are nested or disjoint, the outer ones first; `pads` is the room of a frame around its content, and above.

    >>> sizes = dict.fromkeys("abc", (96.0, 80.0))
    >>> framed_places(sizes, [("a", "b"), ("b", "c")], {"frame": ["b", "c"]}, (16.0, 40.0))
    {'a': (0.0, 32.0), 'b': (176.0, 40.0), 'c': (336.0, 40.0)}
    """
    wires, units, unit_of = list(wires), dict(sizes), {id: id for id in sizes}
    contents: dict[str, dict[str, tuple[float, float]]] = {}

    def arranged(ids: Iterable[str]) -> dict[str, tuple[float, float]]:
        ends = [(unit_of.get(a, a), unit_of.get(b, b)) for a, b in wires]
        return layered_places({id: units[id] for id in ids}, ends)

    around, above = pads
    for frame, members in reversed(frames.items()):
        contents[frame] = content = arranged(dict.fromkeys(unit_of[id] for id in members))
        right, bottom = (max(at[i] + units[id][i] for id, at in content.items()) for i in (0, 1))
        units = {id: size for id, size in units.items() if id not in content}
        units[frame] = right + 2 * around, bottom + around + above
        unit_of |= dict.fromkeys(members, frame)
    places = arranged(units)
    for frame in frames:
        x, y = places.pop(frame)
        places |= {id: (x + around + dx, y + above + dy) for id, (dx, dy) in contents[frame].items()}
    return places


def layered_places(
    sizes: Mapping[str, tuple[float, float]], wires: Iterable[tuple[str, str]]
) -> dict[str, tuple[float, float]]:
    """Return positions for nodes of these sizes, in columns along the signal flow, from (0, 0) on; those without wires
    are in rows below.

    A node is as far left as its sources allow, but next to its targets. Within a column, nodes follow the order and
    approximate height of their neighbours. Wires to what is not arranged count: beside a node they need their room.

    >>> layered_places(dict.fromkeys("abcd", (96.0, 80.0)), [("a", "b")])
    {'a': (0.0, 0.0), 'b': (160.0, 0.0), 'c': (0.0, 96.0), 'd': (120.0, 96.0)}
    >>> layered_places(dict.fromkeys("ab", (96.0, 80.0)), [("a", "elsewhere"), ("elsewhere", "b")])
    {'a': (0.0, 0.0), 'b': (0.0, 96.0)}
    """
    between = {(a, b) for a, b in wires if a != b}
    edges = _without_cycles(sorted((a, b) for a, b in between if a in sizes and b in sizes))
    wired = {id for ends in between for id in ends if id in sizes}
    places = _column_places({id: size for id, size in sizes.items() if id in wired}, edges) if wired else {}
    right, bottom = (max((places[id][i] + sizes[id][i] for id in places), default=-GAP) for i in (0, 1))
    loose = {id: size for id, size in sizes.items() if id not in wired}
    return places | _row_places(loose, bottom + GAP, right)


def _row_places(sizes: Mapping[str, tuple[float, float]], top: float, width: float) -> dict[str, tuple[float, float]]:
    """Return positions in rows below `top`, which are as wide as given, or as makes them about as high as wide, or as
    the widest three beside each other: of a few, one row.
    """
    area = sum((wide + GAP_BESIDE) * (high + GAP) for wide, high in sizes.values())
    three = sum(sorted(wide + GAP_BESIDE for wide, _ in sizes.values())[-3:])
    width = max(width, area**0.5, three)
    places, x, y, row_height = dict[str, tuple[float, float]](), 0.0, _on_grid(top), 0.0
    for id, (wide, high) in sizes.items():
        if x > 0.0 and x + wide > width:
            x, y, row_height = 0.0, _on_grid(y + row_height + GAP), 0.0
        places[id] = x, y
        x, row_height = _on_grid(x + wide + GAP_BESIDE), max(row_height, high)
    return places


def _on_grid(length: float) -> float:
    """Return the next multiple of the grid that is no smaller."""
    return float(np.ceil(length / GRID) * GRID)


def _column_places(
    sizes: Mapping[str, tuple[float, float]], edges: list[tuple[str, str]]
) -> dict[str, tuple[float, float]]:
    """Return positions of nodes that are all wired, without cycles, in columns."""
    real = list(sizes)
    columns = _columns(real, edges)
    sizes, edges = _with_virtual_nodes(sizes, edges, columns)
    beside: dict[str, list[str]] = {id: [] for id in sizes}
    for a, b in edges:
        beside[a].append(b)
        beside[b].append(a)
    middle: dict[str, float] = {}
    for column in columns:
        _stack(column, {}, sizes, middle)
    for sweep in range(SWEEPS):
        for column in columns if sweep % 2 == 0 else columns[::-1]:
            wanted = {id: _mean({o: middle[o] for o in beside[id]}, sizes) for id in column if beside[id]}
            column.sort(key=lambda id: wanted.get(id, middle[id]))
            _stack(column, wanted, sizes, middle)
    top = min(middle[id] - sizes[id][1] / 2 for id in sizes)
    places, x = {}, 0.0
    for column in columns:
        for id in column:
            places[id] = (x, float(round((middle[id] - sizes[id][1] / 2 - top) / GRID) * GRID))
        x += max(sizes[id][0] for id in column) + COLUMN_GAP
    return {id: places[id] for id in real}


def _without_cycles(edges: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the edges but those that close a cycle, as between frames or sub-patches, though no nodes have one."""
    kept, following = list[tuple[str, str]](), defaultdict[str, set[str]](set)
    for a, b in edges:
        if a not in reached([b], following):
            kept.append((a, b))
            following[a].add(b)
    return kept


def _with_virtual_nodes(
    sizes: Mapping[str, tuple[float, float]], edges: Sequence[tuple[str, str]], columns: Sequence[list[str]]
) -> tuple[dict[str, tuple[float, float]], list[tuple[str, str]]]:
    """Return sizes and edges with a thin virtual node in each column that a long wire crosses, as its gap."""
    at = {id: i for i, column in enumerate(columns) for id in column}
    all_sizes, short = dict(sizes), []
    for a, b in edges:
        before = a
        for i in range(at[a] + 1, at[b]):
            virtual = f"{a}>{b}>{i}"
            all_sizes[virtual] = LANE
            columns[i].append(virtual)
            short.append((before, virtual))
            before = virtual
        short.append((before, b))
    return all_sizes, short


def _columns(ids: list[str], edges: Sequence[tuple[str, str]]) -> list[list[str]]:
    """Return the nodes by longest path from a source; nodes without sources are placed just before their targets."""
    sources: dict[str, list[str]] = {id: [] for id in ids}
    targets: dict[str, list[str]] = {id: [] for id in ids}
    for a, b in edges:
        sources[b].append(a)
        targets[a].append(b)
    waiting = {id: len(sources[id]) for id in ids}
    order = [id for id in ids if not waiting[id]]
    depth = dict.fromkeys(ids, 0)
    for id in order:
        for target in targets[id]:
            depth[target] = max(depth[target], depth[id] + 1)
            waiting[target] -= 1
            if not waiting[target]:
                order.append(target)
    for id in ids:
        if not sources[id] and targets[id]:
            depth[id] = min(depth[target] for target in targets[id]) - 1
    used = sorted(set(depth.values()))
    return [[id for id in ids if depth[id] == one] for one in used]


def _stack(
    column: Sequence[str],
    wanted: Mapping[str, float],
    sizes: Mapping[str, tuple[float, float]],
    middle: dict[str, float],
) -> None:
    """Set the heights of a column's nodes near the wanted ones, in this order and without overlap."""
    at = 0.0
    for i, id in enumerate(column):
        half = sizes[id][1] / 2
        free = wanted.get(id, at + half)
        middle[id] = free if i == 0 else max(free, at + half)
        at = middle[id] + half + GAP
    meant = {id: wanted[id] - middle[id] for id in column if id in wanted}
    by = _mean(meant, sizes) if meant else 0.0
    for id in column:
        middle[id] += by


def _mean(values: Mapping[str, float], sizes: Mapping[str, tuple[float, float]]) -> float:
    """Return the mean of nodes' values; those of lanes count more, or wires would pass behind what is beside them."""
    return fmean(values.values(), [LANE_WEIGHT if sizes[id] == LANE else 1.0 for id in values])


def _bounding_box(boxes: Sequence[Box]) -> np.ndarray:
    """Return the bounding box of all boxes, as an array [1, 4]."""
    sides = np.array(boxes)
    low = sides[:, :2].min(axis=0)
    return np.concatenate([low, (sides[:, :2] + sides[:, 2:]).max(axis=0) - low])[None]


def _shifts(reach: int) -> np.ndarray:
    """Return all shifts within reach, [shift, 2], shortest first; of equal ones, that down and right first."""
    across = GRID * np.arange(-reach, reach + 1, GRID_STEP)
    x, y = (part.ravel() for part in np.meshgrid(across, across))
    return np.stack([x, y], axis=1)[np.lexsort((-x, -y, x * x + y * y))].astype(float)
