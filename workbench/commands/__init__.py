"""The commands that need no screen, one a file: `NAME.py` here defines the click command `NAME`.

A new file is a new command; there is no list to add it to. Files that define no command of their own name are what
several commands share.
"""

import os
from contextlib import ExitStack
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class SentenceGroup(click.Group):
    """A group whose help says what each command does as a whole sentence."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command of the first word; what is none is refused with what may be meant."""
        word = args[0]
        if not word.startswith("-") and not ctx.resilient_parsing and self.get_command(ctx, word) is None:
            ctx.fail(f"No such command {word!r}{self.meant(ctx, word)}")
        return super().resolve_command(ctx, args)

    def meant(self, ctx: click.Context, word: str) -> str:
        """Return the end of a sentence: which command is like a word that is none."""
        like = get_close_matches(word.lower(), self.list_commands(ctx), 1)
        return "".join(f". Did you mean {one!r}?" for one in like)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what each command does, on several lines where it needs them."""
        found = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [(name, (command.help or "").split("\n\n")[0]) for name, command in found if command is not None]
        with formatter.section("Commands"):
            formatter.write_dl([(name, " ".join(text.split())) for name, text in rows])


class CommandGroup(SentenceGroup):
    """A group whose commands are the files of this package, each imported only when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands in alphabetical order."""
        return [name for name in _modules() if self.get_command(ctx, name) is not None]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Treat `underfoot FILE` as `--patch FILE` if it ends in .json, else as `--recording FILE`."""
        if args and args[0] not in _modules() and _names_file(args[0]):
            args = ["--patch" if args[0].lower().endswith(".json") else "--recording", *args]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> object:
        """Run a command, or the window. What `ctx.obj` is given ends with it, and hears what it raises."""
        with ExitStack() as ctx.obj:
            return super().invoke(ctx)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> "list[CompletionItem]":
        """Return the commands and options that begin so or, if none does, that the shell has the files."""
        from click.shell_completion import CompletionItem

        return super().shell_complete(ctx, incomplete) or [CompletionItem(incomplete, type="file")]

    def meant(self, ctx: click.Context, word: str) -> str:
        """Return the same, or how the preset is opened that a word is, or is like."""
        from underfoot.patch import preset_files

        presets = preset_files.patches()
        like = get_close_matches(word.lower(), [*presets, *self.list_commands(ctx)], 1)
        opens = "".join(f"; `underfoot --patch {one}` opens the preset" for one in like if one in presets)
        return opens or super().meant(ctx, word)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of this name, or None."""
        if cmd_name not in _modules():
            return None
        found = getattr(import_module(f"{__name__}.{cmd_name}"), cmd_name, None)
        return found if isinstance(found, click.Command) else None


def _names_file(word: str) -> bool:
    """Return whether an unknown command is the path of a file: it has a folder or a suffix, and need not exist."""
    has_place = bool(os.path.dirname(word) or os.path.splitext(word)[1])
    return not word.startswith("-") and (has_place or os.path.isfile(word))


def _modules() -> list[str]:
    return sorted(module.name for module in iter_modules(__path__))
