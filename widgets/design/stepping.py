"""Selecting by keys: stepping from item to item, and keeping some selected meanwhile."""

from underfoot.quantities import counted
from underfoot.widgets.design.patch_view import PatchView
from underfoot.widgets.design.spoken_selection import spoken_selection


class Stepping:
    """Steps through the items of a view in the order of the patch. Any other selection begins anew."""

    def __init__(self, view: PatchView) -> None:
        self._view = view
        self._at = ""
        """The item that was last stepped to."""
        self._kept: frozenset[str] = frozenset()
        """Those that stay selected when another is stepped to."""

    def forget(self) -> None:
        """Keep nothing: the selection was changed otherwise."""
        self._at, self._kept = "", frozenset()

    def step(self, by: int) -> None:
        """Select the next item (`by` steps) beside those that are kept, and scroll to it."""
        scene = self._view.patch_scene
        ids, now = list(scene.movable()), scene.selected()
        if ids:
            here = self._at if self._at in now else now[-1] if now else ""
            at = ids[(ids.index(here) + by if here else (0 if by > 0 else -1)) % len(ids)]
            kept = self._kept  # which are forgotten with each new selection
            scene.select({*kept, at})
            self._at, self._kept = at, kept
            self._view.setAccessibleDescription(spoken_selection(scene, at))
            self._view.ensure_visible([at])

    def keep(self) -> None:
        """Keep what is selected while others are stepped to; if the one stepped to is kept, let it go."""
        now = self._view.patch_scene.selected()
        if not now:
            self._view.show_message("Select what to keep selected")
        elif self._at in self._kept:
            self._kept -= {self._at}
            self._view.show_message("Not kept any more; N goes on without it", alarm=False)
        else:
            self._at, self._kept = self._at if self._at in now else now[-1], frozenset(now)
            self._view.show_message(f"{counted(len(now), 'item')} kept; N goes on to another", alarm=False)
