"""Custom nodes in files beside a patch, `nodes/TYPE.py`, run only with the user's consent.

The file name gives the node type, so that nothing needs to be run to know it. Exactly the bytes that were agreed to are
run, in this process and in every process that it starts: the file is not read a second time.
"""

import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType

from msgspec.structs import replace

from underfoot.errors import BadFile, kind_and_words
from underfoot.files import make_folder, read_file, write_file
from underfoot.patch.node import NodeType, Port, Registry, installed_nodes, node
from underfoot.patch.node_files import FOLDER, RUNNING, NodeFile, has_nodes

LARGEST = 1_000_000
"""Largest size of such a file, in bytes."""
MISSING = "Missing"
"""Family of nodes that stand in for those that were not run."""

_consent = {"all": False}
"""Whether the user has agreed to all files beside the patches that this process reads."""


@contextmanager
def allow_all_node_files() -> Iterator[None]:
    """Allow every custom node file that patches need, within the context; for a command-line option."""
    _consent["all"] = True
    try:
        yield
    finally:
        _consent["all"] = False


def node_files(folder: Path | None) -> list[NodeFile]:
    """Return the node files beside patches in `folder`, by name, of types not installed. None of them is run.

    >>> node_files(Path("there is none"))
    []
    """
    if folder is None or not has_nodes(folder):
        return []
    registry = installed_nodes()
    free = [path for path in sorted((folder / FOLDER).glob("*.py")) if _is_own(path.stem, registry)]
    return [NodeFile(str(path.absolute()), _read(path)) for path in free]


def unknown_types(types: Iterable[str]) -> list[str]:
    """Return those of these types that are not installed, neither by Underfoot nor by a plug-in.

    >>> unknown_types(["tone", "squeak"])
    ['squeak']
    """
    registry = installed_nodes()
    return list(dict.fromkeys(type for type in types if _is_own(type, registry)))


def run_file(file: NodeFile) -> bool:
    """Run a file that the user has agreed to, and register its node; return whether it is new here.

    `BadFile` if it fails, or does not declare the node of its name.
    """
    if RUNNING.get(file.type) == file:
        return False
    name = f"underfoot_own_nodes.{file.type}_{file.sha256[:16]}"
    module = ModuleType(name)
    module.__file__ = file.path
    sys.modules[name] = module
    try:
        exec(compile(file.source, file.path, "exec"), vars(module))
    except (Exception, SystemExit) as error:  # untrusted code can raise anything
        del sys.modules[name]
        raise BadFile(f"{file.path} cannot be run: {kind_and_words(error)}") from None
    found = [value for value in vars(module).values() if isinstance(value, NodeType)]
    made = next((one for one in found if one.type == file.type), None)
    if made is None:
        has = ", ".join(one.type for one in found) or "none"
        raise BadFile(f"{file.path} has no node {file.type!r} but {has}; the file is called as its node is")
    _put(made)
    RUNNING[file.type] = file
    return True


def run_received(files: Iterable[NodeFile]) -> None:
    """Run the files that the parent process runs. A file that fails leaves its node unknown; its users report that."""
    for file in files:
        with suppress(BadFile):
            run_file(file)


def files_needed(used: Iterable[str], folder: Path | None) -> list[NodeFile]:
    """Return the files beside patches in `folder` with nodes of these types that do not run yet."""
    types = unknown_types(used)
    wanted = [file for file in node_files(folder) if file.type in types] if types else []
    return [file for file in wanted if (known := RUNNING.get(file.type)) is None or known.source != file.source]


def run_needed(used: Iterable[str], path: Path) -> None:
    """Run the files that the patch in the file `path` needs, if the user has agreed to that.

    `used` are the types of its nodes. `BadFile` without consent, or for two different files of one name.
    """
    fresh = files_needed(used, path.parent)
    for file in fresh:
        if other := running_elsewhere(file):
            raise BadFile(f"{file.path} and {other} are two different nodes of one name; use their patches one by one")
    if fresh and not _consent["all"]:
        files = ", ".join(file.path for file in fresh[:3])
        raise BadFile(
            f"{path} needs {files}, which runs with your rights; look at it, then allow it: --run-code on the command "
            "line, a question in the window, in a script `with allow_all_node_files():` from "
            "underfoot.patch.custom_nodes"
        )
    for file in fresh:
        run_file(file)


def running_elsewhere(file: NodeFile) -> str:
    """Return the path of another file whose node of the same name runs; "" if there is none."""
    known = RUNNING.get(file.type)
    return "" if known is None or known.path == file.path else known.path


def copy_needed(used: Iterable[str], before: Path | None, after: Path) -> list[str]:
    """Copy the files that a patch of these types needs from beside it in the folder `before` to beside it in `after`.

    A running node is copied as it runs. An existing file stays. Returns messages on the files that are not there as
    needed.
    """
    there = {file.type: file for file in node_files(after)}
    known = {file.type: file for file in node_files(before)} | RUNNING
    wrong = []
    for type in unknown_types(used):
        name = f"{FOLDER}/{type}.py"
        if type not in known:
            wrong += [] if type in there else [f"{name} does not lie beside it: copy it there"]
        elif type not in there:
            write_file(make_folder(after / FOLDER) / f"{type}.py", known[type].source)
        elif before != after and there[type].source != known[type].source:
            wrong.append(f"{name} beside it is another one, and stays")
    return wrong


# --- stand-ins for nodes that are not run ---


def add_stand_ins(types: Mapping[str, str], wires: Iterable[tuple[str, str]], reasons: Mapping[str, str]) -> None:
    """Register a stand-in for each of these types that keeps what the patch stores, for the window to show and save.

    `types` are those of a patch's nodes by their ids. `reasons` give, by type, why the node itself is missing. Ports
    are those at which wires end.
    """
    registry = installed_nodes()
    for name, reason in reasons.items():
        known = registry.get(name)
        inputs, outputs = dict[str, Port](), dict[str, Port]()
        if known is not None and known.missing:  # ports that another patch has wired
            inputs |= {port.name: port for port in known.inputs}
            outputs |= {port.name: port for port in known.outputs}
        for source, target in wires:
            (giver, _, given), (taker, _, taken) = source.partition("."), target.partition(".")
            if types.get(giver) == name:
                there = registry[types[taker]].input_ports if types.get(taker, "") in registry else {}
                outputs[given] = Port(given, there[taken].kind if taken in there else "signal")
            if types.get(taker) == name:
                there = registry[types[giver]].output_ports if types.get(giver, "") in registry else {}
                inputs[taken] = Port(taken, there[given].kind if given in there else "signal")
        doc = f"This node is missing: {reason}."
        made = node("stand-in", MISSING, f"{name} (missing)")(type("StandIn", (), {"__doc__": doc}))
        _put(
            replace(
                made,
                type=name,  # whatever the file has
                inputs=tuple(inputs.values()),
                outputs=tuple(outputs.values()),
                missing=reason,
                accuracy="it puts out nothing.",
            )
        )
        RUNNING.pop(name, None)


def _is_own(type: str, registry: Registry) -> bool:
    return type not in registry or type in RUNNING or bool(registry[type].missing)


def _put(made: NodeType) -> None:
    registry = installed_nodes()
    assert isinstance(registry, dict)  # read-only for all others
    registry[made.type] = made


def _read(path: Path) -> bytes:
    if not path.is_file():
        raise BadFile(f"{path} is no ordinary file, and is not read")
    if path.stat().st_size > LARGEST:
        raise BadFile(f"{path} has {path.stat().st_size} bytes; allowed: {LARGEST} for a file of a node")
    return read_file(path)
