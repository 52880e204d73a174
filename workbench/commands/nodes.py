"""`underfoot nodes`: the node reference."""

import json
from collections.abc import Iterable

import click

from underfoot.commands.files import complete_names
from underfoot.errors import BadValue


def _types() -> Iterable[str]:
    from underfoot.nodes import REGISTRY

    return REGISTRY


@click.command()
@click.argument("type", required=False, shell_complete=complete_names(_types))
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def nodes(type: str | None, as_json: bool) -> None:
    """Print the node reference: every node with its ports and parameters, or one TYPE."""
    from underfoot.nodes import REGISTRY
    from underfoot.patch.reference import reference, text

    if type is not None and type not in REGISTRY:
        raise BadValue(f"there is no node {type!r}; allowed: {', '.join(sorted(REGISTRY))}")
    chosen = {type: REGISTRY[type]} if type else REGISTRY
    print(json.dumps(reference(chosen), indent=1) if as_json else text(chosen))
