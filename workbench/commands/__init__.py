"""The commands that need no screen, one a file."""

from workbench.commands.bench import bench
from workbench.commands.calibrate import calibrate
from workbench.commands.emulate import emulate
from workbench.commands.monitor import monitor
from workbench.commands.nodes import nodes
from workbench.commands.render import render
from workbench.commands.tile import tile

COMMANDS = (calibrate, render, monitor, nodes, bench, emulate, tile)
