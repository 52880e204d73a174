"""Version of the program, as its files and reports name it."""

__version__ = "0.1.0"
