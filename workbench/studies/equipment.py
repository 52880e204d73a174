"""Equipment of a study beside the floor: the stiffness plate, masking sound, and markers for other recorders."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from underfoot.devices.plate import Plate, calibration_of, plate_of
from underfoot.errors import BadValue
from underfoot.experiments.protocol import Protocol, Sounds
from underfoot.floor.layout import Floor
from underfoot.network.lsl_library import lsl_library
from underfoot.studies.markers import LslMarkers, Markers, SerialTrigger
from underfoot.studies.masking import Masking, is_audible


@dataclass(frozen=True)
class Equipment:
    """Optional equipment; `close` releases all of it."""

    plate: Plate | None = None
    masking: Masking | None = None
    markers: Sequence[Markers] = ()

    def mark(self, what: str, text: str, time_s: float | None = None, ago_s: float = 0.0) -> None:
        """Send a marker for an event of now, or of the session's `time_s`, `ago_s` ago, to all recorders."""
        for marker in self.markers:
            marker.mark(what, text, time_s, ago_s)

    def lacks(self, protocol: Protocol) -> str:
        """Return what of a protocol is not set, or not heard, without more equipment; "" for nothing.

        Raises `BadValue` for a stiffness that the plate does not have.

        >>> Equipment().lacks(Protocol(stimuli={}, stages=(), sounds=Sounds(noise="pink")))
        "without masking sound: the protocol's is not heard"
        """
        found = list[str]()
        stiffness = {name: one.stiffness_n_mm for name, one in protocol.stimuli.items() if one.stiffness_n_mm > 0.0}
        if self.plate is not None:
            for name, wanted in stiffness.items():
                try:
                    self.plate.calibration.position(wanted)
                except BadValue as error:
                    raise BadValue(f"stimulus {name}: {error}, which the plate has") from None
        elif stiffness:
            ends = dict.fromkeys(f"{end(stiffness.values()):g}" for end in (min, max))
            found.append(f"without a plate: the stimuli's stiffness, {' to '.join(ends)} N/mm, is not set")
        if self.masking is None and is_audible(protocol.sounds):
            found.append("without masking sound: the protocol's is not heard")
        return "; ".join(found)

    @property
    def problem(self) -> str:
        """Why the masking sound has stopped, or markers do not reach a recorder now; "" if all is well."""
        unheard = self.masking.problem if self.masking is not None else ""
        return "; ".join(filter(None, (unheard, *(marker.problem for marker in self.markers))))

    def forces(self, time_s: float, ago_s: float, force_n: NDArray[np.float64]) -> None:
        """Send new force samples in N, [sample, tile], to all recorders; the last one is of `time_s`, `ago_s` ago."""
        for marker in self.markers:
            marker.forces(time_s, ago_s, force_n)

    def close(self) -> None:
        """Release plate, sound and markers."""
        for one in (self.plate, self.masking, *self.markers):
            if one is not None:
                one.close()


class EquipmentChoice(msgspec.Struct, frozen=True):
    """The selected equipment; "" for none.

    `plate` has the format of `plate_of`. `masking` is the sound device ("" for the default, None for no sound),
    `trigger` a serial port, and `lsl` enables LSL streams.

    >>> EquipmentChoice(trigger="/dev/ttyUSB0", masking="").text
    'masking sound, trigger'
    """

    plate: str = ""
    masking: str | None = None
    trigger: str = ""
    lsl: bool = False

    @property
    def text(self) -> str:
        """A description of the equipment in one line; "" for none."""
        used = {
            "plate": self.plate,
            "masking sound": self.masking is not None,
            "trigger": self.trigger,
            "LSL": self.lsl,
        }
        return ", ".join(name for name, on in used.items() if on)

    def check(self) -> None:
        """Raise an error for a mistake that can be found without opening a device."""
        if self.plate:
            calibration_of(self.plate)
        if self.lsl:
            lsl_library()

    def opened(self, sounds: Sounds, floor: Floor, force_hz: float) -> Equipment:
        """Open all equipment for a study with these sounds; after an error, close all parts again."""
        with ExitStack() as unless_all:
            plate = plate_of(self.plate) if self.plate else None
            if plate is not None:
                unless_all.callback(plate.close)
            masking = Masking(sounds, self.masking) if self.masking is not None and is_audible(sounds) else None
            if masking is not None:
                unless_all.callback(masking.close)
            markers: list[Markers] = []
            if self.trigger:
                markers.append(SerialTrigger(self.trigger))
                unless_all.callback(markers[0].close)
            if self.lsl:
                markers.append(LslMarkers(floor, force_hz))
            unless_all.pop_all()
            return Equipment(plate, masking, markers)
