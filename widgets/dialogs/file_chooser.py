"""Asking for a file."""

import re
from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QWidget

from underfoot.errors import UnderfootError
from underfoot.widgets.controls.file_dialog import ask_file, ask_save


class FileChooser:
    """Asks for files in dialogs of one window, each from the folder `folder()` on; errors of ours go to `notify`.

    Those of a file that was to be read go to `refuse` with its path, if it is given.
    """

    def __init__(
        self,
        window: QWidget,
        folder: Callable[[], str],
        notify: Callable[[str], object],
        refuse: Callable[[Path, str], object] | None = None,
    ) -> None:
        self._window, self._folder, self._notify, self._refuse = window, folder, notify, refuse

    def ask(
        self,
        title: str,
        filter: str,
        then: Callable[[Path], object],
        save_as: str = "",
        suffix: str = ".json",
        over: QWidget | None = None,
    ) -> None:
        """Ask for a file and go on with `then`; for one to be written where there is a name `save_as` to begin with.

        In that name, signs that no file's may have become hyphens: titles of patches may have them. A name without a
        suffix gets `suffix`. A question `over` a dialog ends with it: nobody waits for an answer then.
        """

        def chosen(path: Path) -> None:
            try:
                then(path)
            except UnderfootError as error:
                if self._refuse is not None and not save_as:
                    self._refuse(path, str(error))
                else:
                    self._notify(str(error))

        parent = over or self._window
        if save_as:
            name = Path(self._folder()) / re.sub(r'[/\\:*?"<>|]', "-", save_as)
            ask_save(parent, title, str(name), filter, suffix, chosen)
        else:
            ask_file(parent, title, filter, chosen, self._folder())
