"""Spectrograms: levels over time and frequency, with lines around the band that the sole feels."""

from underfoot.drawing import Drawing, HeatMap, Range, ReferenceLine

FELT_HZ = (40.0, 1000.0)
"""The band that the sole feels (thesis 2.1)."""
FELT = (ReferenceLine("y", FELT_HZ[0], dashed=True), ReferenceLine("y", FELT_HZ[1], dashed=True))


def spectrogram(
    heat: HeatMap | None,
    time: str,
    time_range: Range,
    frequency_range_hz: Range,
    log: bool = True,
    lines: tuple[ReferenceLine, ...] = FELT,
    note: str = "",
) -> Drawing:
    """Return a spectrogram; `time` is the label of its time axis. `note` says why there is no `heat`."""
    return Drawing(
        "Spectrogram",
        time,
        "frequency, Hz",
        y_log=log,
        x_range=time_range,
        y_range=frequency_range_hz,
        lines=lines,
        heat=heat,
        note=note,
    )
