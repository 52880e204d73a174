"""What a tile will do before it is built: suspension, plate and response from material and size, beside the thesis's.

Where our value differs from the thesis's (chapter 4, corrected as docs/models.md#plate has it), a sentence
says why.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.floor.layout import Floor, Tile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.suspension import deflection_at_resonance_m

LOAD_N = 1000.0
"""The thesis's load: a large person on one corner."""
F0_LIMIT_HZ, SAG_LIMIT_M = 50.0, 0.005
"""What the thesis set out to reach."""
DROP_DB, MIDDLE_HZ = 10.0, (100.0, 500.0)
"""The usable band ends where the response is this far below its median of the middle."""
PLYWOOD = Plate(stiffness="solid", modulus_pa=8e9, poisson=0.0, density_kg_m3=600.0)
ALUMINIUM = Plate(stiffness="solid", modulus_pa=70e9, density_kg_m3=2700.0)

_CORNER_M = 0.133
_THESIS_TILE = Tile(
    "thesis",
    (0.304, 0.304),
    (0.152, 0.152),
    sensors_m=tuple((x * _CORNER_M, y * _CORNER_M) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))),
    sensor_depth_m=0.0254,
)
_MILLI = 1000.0
_SHEAR = 3.0
"""Young's modulus over shear modulus of a material that keeps its volume."""


@dataclass(frozen=True)
class Row:
    """A quantity with its unit: the thesis's value (None: not given), ours for the thesis's tile, and this tile's.

    NaN is the value of a quantity that a tile does not have.
    """

    key: str
    name: str
    unit: str
    thesis: float | None
    ours: float
    here: float
    why: str = ""

    def data(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        numbers = {"thesis": self.thesis, "ours": self.ours, "here": self.here}
        return {
            "name": self.name,
            "unit": self.unit,
            **{k: v if v is not None and math.isfinite(v) else None for k, v in numbers.items()},
            "why": self.why,
        }


@dataclass(frozen=True)
class Design:
    """Properties of one kind of tile; `alike` are the ids of all tiles of this size, with sensors at these places."""

    alike: tuple[str, ...]
    rows: tuple[Row, ...]
    modes_hz: dict[str, list[float]]
    measured: "TileProperties"

    @property
    def size_m(self) -> tuple[float, float]:
        """The tiles' size."""
        return self.measured.tile.size_m

    def data(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        quantities = {row.key: row.data() for row in self.rows}
        return {"tiles": self.alike, "size_m": self.size_m, "quantities": quantities, "modes_hz": self.modes_hz}


def designs(floor: Floor, parameters: TileParameters) -> list[Design]:
    """Return one design for each kind of tile of the floor; `BadValue` if a tile cannot be built of these parts.

    >>> from underfoot.floor.layout import default_floor
    >>> design = designs(default_floor(), TileParameters())[0]
    >>> [(row.key, row.thesis, round(row.ours, 2)) for row in design.rows[:2]]
    [('f0_hz', 49.0, 49.01), ('deflection_corner_mm', 4.5, 11.72)]
    """
    kinds: dict[tuple[object, ...], list[Tile]] = {}
    for tile in floor.tiles:
        kinds.setdefault((tile.size_m, tile.sensors_m), []).append(tile)
    thesis = TileProperties(_THESIS_TILE, TileParameters())
    return [_design(tiles, parameters, thesis) for tiles in kinds.values()]


def _design(tiles: list[Tile], parameters: TileParameters, thesis: "TileProperties") -> Design:
    here = TileProperties(tiles[0], parameters)
    rows = tuple(
        Row(key, name, unit, printed, measure(thesis), measure(here), why)
        for key, name, unit, printed, measure, why in _QUANTITIES
    )
    modes = {"the whole tile, without load": [float(x) for x in here.resonances_hz[:6]]}
    for stiffness in ("solid",) if parameters.plate.stiffness == "solid" else ("thesis", "textbook"):
        own = here.plate_with(stiffness).frequencies_hz(here.tile.size_m, 3)
        modes[f"the plate, edges held, stiffness: {stiffness}"] = sorted(float(x) for x in own)[:6]
    return Design(tuple(tile.id for tile in tiles), rows, modes, here)


class TileProperties:
    """One tile as it is described, not drawn, and what can be asked of it.

    `level_db` is the response without load, dB re 1 m/s^2 a full-scale unit, at `frequencies_hz`; `low_hz` and
    `high_hz` are the ends of its usable band.
    """

    def __init__(self, tile: Tile, parameters: TileParameters) -> None:
        self.tile, self.parameters = tile, parameters
        self.suspension, self.plate = parameters.suspension_of(tile), parameters.plate
        self.resonances_hz = parameters.assembly(tile).undamped()[0] / (2.0 * math.pi)
        self.frequencies_hz = np.geomspace(10.0, 2000.0, 1500)
        self.level_db = self.response_db("none")
        in_middle = (self.frequencies_hz >= MIDDLE_HZ[0]) & (self.frequencies_hz <= MIDDLE_HZ[1])
        below = np.flatnonzero(self.level_db < np.median(self.level_db[in_middle]) - DROP_DB)
        centre = np.searchsorted(self.frequencies_hz, math.sqrt(MIDDLE_HZ[0] * MIDDLE_HZ[1]))
        under, over = below[below < centre], below[below >= centre]
        self.low_hz = float(self.frequencies_hz[under[-1] + 1 if under.size else 0])
        self.high_hz = float(self.frequencies_hz[over[0] - 1 if over.size else -1])

    def response_db(self, load: str) -> NDArray[np.float64]:
        """Return the acceleration at the accelerometer, dB re 1 m/s^2 at full scale."""
        body = self.parameters.assembly(self.tile, load).poles(self._accelerometer_m).transfer(self.frequencies_hz)
        return _db(self.parameters.shaker.transfer(self.frequencies_hz) * body)

    def places_db(self) -> dict[str, NDArray[np.float64]]:
        """Return acceleration per newton at four places, dB re a free rigid tile, as in figure 4.11."""
        x, y = (0.5 * side for side in self.tile.size_m)
        places = {
            "centre": (0.0, 0.0),
            "halfway to an edge": (0.5 * x, 0.0),
            "halfway to a corner": (0.5 * x, 0.5 * y),
            "near a corner": (0.9 * x, 0.9 * y),
        }
        assembly, mass = self.parameters.assembly(self.tile), self.suspension.mass_kg
        return {name: _db(mass * assembly.poles(at).transfer(self.frequencies_hz)) for name, at in places.items()}

    def plate_with(self, stiffness: str) -> Plate:
        """Return the plate with another model of its stiffness."""
        return replace(self.plate, stiffness=stiffness)

    def sandwich(self, stiffness: str, quantity: str) -> float:
        """Return `rigidity_nm` or `frequency_hz` by one of the models of a sandwich; NaN for a solid plate."""
        if self.plate.stiffness == "solid":
            return math.nan
        plate = self.plate_with(stiffness)
        return plate.rigidity_nm() if quantity == "rigidity_nm" else plate.frequency_hz(self.tile.size_m)

    def heave_hz(self) -> float:
        """Return the resonance nearest to f0."""
        return float(self.resonances_hz[self._heave()])

    def tilt_hz(self) -> float:
        """Return the higher of the two tilt resonances: of the three lowest, those that are not the heave."""
        return float(np.delete(self.resonances_hz[:3], self._heave()).max())

    def bend_hz(self, *, is_peak: bool) -> float:
        """Return the deepest dip, or the highest peak, at the accelerometer from 3 f0 on; NaN if there is none."""
        grid = np.linspace(3.0 * self.suspension.resonance_hz(), 3000.0, 5401)
        body = self.parameters.assembly(self.tile).poles(self._accelerometer_m)
        level = _db(body.transfer(grid)) * (1.0 if is_peak else -1.0)
        tops = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
        return float(grid[tops[np.argmax(level[tops])]]) if tops.size else math.nan

    def compression_percent(self, force_n: float) -> float:
        """Return the shortfall of the fundamental of a sine force of this amplitude."""
        sine = np.sin(2.0 * math.pi * np.arange(256) / 256)
        reached = self.parameters.shaker.compressed_n(force_n * sine)
        return 100.0 * (1.0 - 2.0 * float(np.mean(reached * sine)) / force_n)

    def distortion_percent(self, force_n: float) -> float:
        """Return the harmonics of a sine force of this amplitude, relative to the fundamental."""
        sine = np.sin(2.0 * math.pi * np.arange(256) / 256)
        spectrum = np.abs(np.fft.rfft(self.parameters.shaker.compressed_n(force_n * sine)))
        return 100.0 * float(np.linalg.norm(spectrum[2:]) / spectrum[1])

    def sway_hz(self) -> float:
        """Return the two sideways resonances; the shear modulus of rubber is a third of its Young's modulus."""
        return self.suspension.resonance_hz() / math.sqrt(_SHEAR)

    def yaw_hz(self) -> float:
        """Return the resonance about the upright axis: mounts shear, and the mass is spread over the tile."""
        x, y = np.array(self.tile.sensors_m).T
        arms = float(np.mean(x**2 + y**2))
        inertia = (self.tile.size_m[0] ** 2 + self.tile.size_m[1] ** 2) / 12.0
        return self.sway_hz() * math.sqrt(arms / inertia)

    def least_force_n(self) -> float:
        """Return the least force of a full-scale sine from 50 to 750 Hz."""
        asked = np.abs(self.parameters.shaker.transfer(np.linspace(50.0, 750.0, 1401)))
        return float(self.parameters.shaker.compressed_n(asked).min())

    def _heave(self) -> int:
        return int(np.argmin(np.abs(self.resonances_hz[:3] - self.suspension.resonance_hz())))

    @property
    def _accelerometer_m(self) -> tuple[float, float]:
        return self.parameters.accelerometer_m(self.tile)


def _sag_mm(load: str) -> Callable[[TileProperties], float]:
    return lambda t: _MILLI * t.suspension.deflection_m(LOAD_N, load)


_QUANTITIES: tuple[tuple[str, str, str, float | None, Callable[[TileProperties], float], str], ...] = (
    ("f0_hz", "suspension resonance f0", "Hz", 49.0, lambda t: t.suspension.resonance_hz(), ""),
    (
        "deflection_corner_mm", "deflection, 1000 N over one corner", "mm", 4.5, _sag_mm("corner"),
        "A rigid plate loaded over one of four mounts sinks there by 3F/4K. 4.5 mm would be F/4K, shared by all four, "
        "at an f0 of 45.7 Hz.",
    ),
    ("deflection_shared_mm", "deflection, 1000 N shared by four", "mm", None, _sag_mm("shared"), ""),
    ("deflection_one_mount_mm", "deflection, 1000 N on one mount alone", "mm", None, _sag_mm("one mount"), ""),
    (
        "deflection_least_mm", "least deflection that f0 <= 50 Hz allows, shared", "mm", None,
        lambda t: _MILLI * float(deflection_at_resonance_m(F0_LIMIT_HZ, t.suspension.mass_kg, LOAD_N)),
        "It is F / (M w0^2), whatever the material: the thesis's 5 mm can be kept for a shared load only.",
    ),
    (
        "rigidity_thesis_nm", "flexural rigidity, thesis's", "N m", None, lambda t: t.sandwich("thesis", "rigidity_nm"),
        "The modulus above equation 4.5 belongs to a plate that is sqrt(3) times thicker than h.",
    ),
    (
        "rigidity_textbook_nm", "flexural rigidity, textbook's", "N m", None,
        lambda t: t.sandwich("textbook", "rigidity_nm"),
        "E_f t_f h^2 / 2 for thin facings, 5.196 times the thesis's; the core's shear is left out.",
    ),
    (
        "f1_thesis_hz", "plate's f1, edges held, thesis's stiffness", "Hz", 860.0,
        lambda t: t.sandwich("thesis", "frequency_hz"),
        "860.7 Hz with the panel's 2.54 cm; the text's 2.5 cm give 853.9 Hz.",
    ),
    (
        "f1_textbook_hz", "plate's f1, edges held, textbook's stiffness", "Hz", None,
        lambda t: t.sandwich("textbook", "frequency_hz"),
        "Nobody measures such a mode, because the shaker hangs at its antinode: see the tile's own resonances.",
    ),
    ("f1_hz", "plate's f1, edges held, as built", "Hz", None, lambda t: t.plate.frequency_hz(t.tile.size_m), ""),
    (
        "antiresonance_hz", "antiresonance of the tile, at the accelerometer", "Hz", 775.0,
        lambda t: t.bend_hz(is_peak=False),
        "The textbook's plate with 1.1 kg of shaker at its centre. That mass is not given and was chosen to meet the "
        "measured antiresonance; the thesis's 860 Hz come near it because what it leaves out, stiffness and shaker, "
        "cancels.",
    ),
    (
        "bending_hz", "bending resonance of the tile", "Hz", 1100.0, lambda t: t.bend_hz(is_peak=True),
        "Measured near 1100, 896 by finite elements. Real edges are neither held nor free, and the bracket is stiff; "
        "both are left out here.",
    ),
    (
        "heave_hz", "heave of the tile", "Hz", 45.0, lambda t: t.heave_hz(),
        "45 Hz by finite elements, whose mounts also bend and shear.",
    ),
    (
        "tilt_hz", "tilt of the tile", "Hz", 77.0, lambda t: t.tilt_hz(),
        "77 Hz by finite elements; it depends on how the mass is spread, here evenly along the edges.",
    ),
    (
        "sway_hz", "sway of the tile, both ways", "Hz", 28.0, lambda t: t.sway_hz(),
        "28 Hz is the lowest of the thesis's six; which mode it is, is not said. A mount of rubber shears with a third "
        "of its modulus; the centre of mass is taken to lie at the mounts.",
    ),
    (
        "yaw_hz", "turn of the tile about the upright axis", "Hz", 51.0, lambda t: t.yaw_hz(),
        "Four frequencies are printed for six modes: 28, 45, 51 and 77 Hz.",
    ),
    (
        "band_low_hz", "lower end of the band (-10 dB)", "Hz", 50.0, lambda t: t.low_hz,
        "The thesis's band is that of its equaliser; this is without one.",
    ),
    ("band_high_hz", "upper end of the band (-10 dB)", "Hz", 750.0, lambda t: t.high_hz, ""),
    ("force_n", "least force of a full-scale sine, 50 to 750 Hz", "N", 40.0, lambda t: t.least_force_n(), ""),
    (
        "distortion_percent", "distortion of a sine of 30 N", "%", 5.0, lambda t: t.distortion_percent(30.0),
        "\"Slightly more than 5 %\" of nonlinear distortion at 300 Hz. Ours is of a soft saturation that takes 5 % "
        "of the level; the thesis does not say how it was taken.",
    ),
    (
        "compression_percent", "compression of a sine of 30 N", "%", None, lambda t: t.compression_percent(30.0),
        "By how much its fundamental falls short.",
    ),
    (
        "leg_hz", "a body on its leg", "Hz", 150.0, lambda t: t.parameters.foot.leg_hz(),
        "30 kN/m and 50 kg resonate at 3.9 Hz, not at 150; 2.7 kg on that leg would at 16.8 Hz.",
    ),
    (
        "sole_hz", "a foot on its sole", "Hz", 150.0, lambda t: t.parameters.foot.sole_hz(),
        "What moves near 150 Hz is the foot itself; its mass and stiffness are chosen for that, not measured.",
    ),
    (
        "plywood_f1_hz", "plywood of 3.75 cm: f1", "Hz", 400.0,
        lambda t: replace(PLYWOOD, thickness_m=0.0375).frequency_hz(t.tile.size_m),
        "With 8 GPa and 600 kg/m3; 400 Hz belong to about a third of that thickness.",
    ),
    ("mass_kg", "mass that the mounts carry", "kg", 2.7, lambda t: t.suspension.mass_kg, ""),
    (
        "panel_kg", "mass of the panel", "kg", 0.4, lambda t: t.plate.mass_kg(t.tile.size_m),
        "The 210 kg/m3 of the computation make 493 g; 400 g would be 170 kg/m3, and an f1 of 955 Hz.",
    ),
)  # fmt: skip
"""Key, name, unit, the thesis's value, how ours is got, and why the two differ."""


def _db(response: NDArray[np.complex128]) -> NDArray[np.float64]:
    return np.asarray(20.0 * np.log10(np.abs(response)))
