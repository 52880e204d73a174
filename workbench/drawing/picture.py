"""Pictures for scripts and notebooks: one drawing, or several stacked."""

from pathlib import Path

from msgspec import Struct

from underfoot.documents import as_declared
from underfoot.drawing import Drawing
from underfoot.errors import BadFile
from underfoot.files import path_of, write_file


class Picture(Struct, frozen=True, eq=False):
    """Result of `plot`: a notebook displays it, `save` writes it.

    >>> from underfoot.drawing import series
    >>> Picture((Drawing("Creep", "time, s", "force, N", (series("held", [1, 10], [40, 41]),)),))
    <Picture: Creep>
    """

    drawings: tuple[Drawing, ...]

    def __post_init__(self) -> None:
        as_declared(self)

    def __repr__(self) -> str:
        return f"<Picture: {', '.join(drawing.title for drawing in self.drawings)}>"

    def _repr_svg_(self) -> str:
        """Return the picture for Jupyter."""
        from underfoot.drawing.svg import WIDTH, height_of, svg  # only when something is drawn: it takes 20 ms

        if len(self.drawings) == 1:
            return svg(self.drawings[0])
        heights = [height_of(drawing) for drawing in self.drawings]
        height = sum(heights)
        size = f'viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}"'
        parts = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">']
        for row, drawing in enumerate(self.drawings):
            inner = svg(drawing).partition(">")[2].rpartition("</svg>")[0]
            parts.append(f'<g transform="translate(0 {sum(heights[:row])})">{inner}</g>')
        return "\n".join([*parts, "</svg>\n"])

    def save(self, path: str | Path) -> None:
        """Write the picture as SVG; `BadFile` for another extension, or if it cannot be written."""
        if path_of(path).suffix.lower() != ".svg":
            raise BadFile(f"{path} is no name of a picture; allowed: a name that ends in .svg")
        write_file(path, self._repr_svg_().encode())
