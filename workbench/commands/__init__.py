"""The commands that need no screen, one a file."""

from underfoot.commands.bench import bench
from underfoot.commands.calibrate import calibrate
from underfoot.commands.emulate import emulate
from underfoot.commands.monitor import monitor
from underfoot.commands.nodes import nodes
from underfoot.commands.render import render
from underfoot.commands.tile import tile

COMMANDS = (calibrate, render, monitor, nodes, bench, emulate, tile)
