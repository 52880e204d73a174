"""The commands that need no screen, one a file."""

from workbench.commands.bench import bench
from workbench.commands.monitor import monitor
from workbench.commands.nodes import nodes
from workbench.commands.render import render

COMMANDS = (render, monitor, nodes, bench)
