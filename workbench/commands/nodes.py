"""`underfoot nodes`: the node reference."""

import json

import click

from underfoot.errors import BadValue


@click.command()
@click.argument("type", required=False)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def nodes(type: str | None, as_json: bool) -> None:
    """Print the node reference: every node with its ports and parameters, or one TYPE."""
    from underfoot.nodes import REGISTRY
    from underfoot.patch.reference import reference, text

    if type is not None and type not in REGISTRY:
        raise BadValue(f"there is no node {type!r}; allowed: {', '.join(sorted(REGISTRY))}")
    chosen = {type: REGISTRY[type]} if type else REGISTRY
    print(json.dumps(reference(chosen), indent=1) if as_json else text(chosen))
