"""Titles of results, and readable labels and units of figures.

Names of figures are keys of profiles and of JSON output; they end with their unit, as in `mean_after_mm`.
"""

import re

from underfoot.floor.profile_parts import PARTS

_UNITS = {
    "n_per_mm": "N/mm", "percent_decade": "% a decade", "percent": "%", "mm": "mm", "hz": "Hz", "db": "dB", "ms": "ms",
    "ms2": "m/s^2", "per_unit": "m/s^2", "n": "N", "m": "m", "s": "s",
}  # fmt: skip
"""Units as suffixes of the names of figures."""
_ERRORS = re.compile("(error|bound|hysteresis|repeatability|expanded|scatter|reference)_percent")
"""Figures in % that are errors; others, as spread and distortion, are of something else."""
_WORDS = {
    "round_trip_99_ms": "round_trip,_99 %",
    "round_trip_worst_ms": "round_trip,_worst",
    "bound_percent": "least_error_of_any_static_curve",
    "memory_error_percent": "error,_hysteresis_compensated",
    "creep_percent_decade": "creep_a_decade_of_time",
    "foot_expanded_percent": "foot:_expanded_uncertainty_(k_=_2)",
    "foot_error_percent": "foot:_error_in_the_middle",
    "foot_scatter_percent": "foot:_errors_of_the_four_sensors",
    "foot_reference_percent": "foot:_the_load_cell's_own_(k_=_1)",
    "footstep_less_percent": "how_much_less_a_footstep_may_read",
    "spread_percent": "spread_of_the_sensors",
    "worst_error_percent": "largest_error",
    "mean_before_mm": "mean_error,_uncorrected",
    "p95_before_mm": "p95,_uncorrected",
    "worst_before_mm": "largest_error,_uncorrected",
    "mean_after_mm": "mean_error",
    "p95_after_mm": "p95_of_the_error",
    "worst_after_mm": "largest_error",
    "expanded_mm": "uncertainty_(95 %)",
    "reference_mm": "uncertainty_of_the_pressed_places",
    "mean_over_time_mm": "mean_error,_hysteresis_compensated",
    "p95_over_time_mm": "p95,_hysteresis_compensated",
    "worst_over_time_mm": "largest_error,_hysteresis_compensated",
    "mean_bound_mm": "mean_error,_best_static_curves",
    "p95_bound_mm": "p95,_best_static_curves",
    "worst_bound_mm": "largest_error,_best_static_curves",
    "mean_after_mm_falling": "mean_error_on_falling_loads",
    "shear_mm": "error_by_shear_while_walking",
    "acceleration_per_unit": "acceleration_at_full_scale",
    "acceleration_expanded_percent": "acceleration:_uncertainty_(k_=_2)",
    "acceleration_reference_percent": "acceleration:_sensor's_own_(k_=_1)",
    "acceleration_repeatability_percent": "acceleration:_repeatability",
    "acceleration_flatness_percent": "acceleration:_deviation_from_flat",
    "acceleration_linearity_percent": "acceleration:_change_with_level",
    "flatness_before_db": "flatness,_uncorrected",
    "flatness_computed_db": "flatness,_computed",
    "flatness_measured_db": "flatness,_measured_again",
    "usable_low_hz": "usable_from",
    "usable_high_hz": "usable_up_to",
    "usable_low_before_hz": "usable_from,_uncorrected",
    "usable_high_before_hz": "usable_up_to,_uncorrected",
    "most_gain_db": "largest_gain_of_the_equaliser",
    "spread_db": "spread_of_the_passes",
    "none_changes_db": "change_by_nobody_on_it",
    "standing_changes_db": "change_by_standing",
    "corner_changes_db": "change_by_a_foot_on_a_corner",
    "thd_loudest_percent": "thd_of_the_loudest_tone",
    "loudest_ms2": "loudest_tone",
    "latency_ms": "delay_of_the_recording",
}
"""Labels of figures whose names are not clear enough."""


def title_of(kind: str, tile: str) -> str:
    """Return the title of a result: what people call the calibration, and its tile, if that is known.

    >>> title_of("fsr", "t1"), title_of("plate", "")
    ('Forces of t1', 'Stiffness')
    """
    return f"{PARTS[kind]} of {tile}" if tile else PARTS[kind]


def label_of(name: str) -> str:
    """Return a figure's label, without its unit.

    >>> label_of("full_scale_n"), label_of("error_percent_2"), label_of("Force")
    ('Full scale', 'Error of sensor 2', 'Force')
    >>> label_of("at_50_hz_db"), label_of("latency_ms")
    ('Level at 50 Hz, equalised', 'Delay of the recording')
    >>> label_of("mean_after_mm_at_150_n"), label_of("p95_before_mm"), label_of("snr_db")
    ('Mean error at 150 N', '95th percentile, uncorrected', 'SNR')
    """
    plain = re.sub(r"^mean_after_mm_(?=at_\d|\d|over_\d)", "mean_error_", _WORDS.get(name, name))
    plain = re.sub(r"^at_(\d+)_hz", r"level_at_\1_hz,_equalised", plain)
    plain = re.sub(r"_(\d+)_(n|hz)(?=[_,]|$)", lambda m: f"_{m[1]} {_UNITS[m[2]]}", plain)
    plain = re.sub(r"^error_percent_(\d)$", r"error of sensor \1", plain)
    plain = re.sub(r"^distortion_(\d)_percent$", r"distortion, harmonic \1", plain)
    plain = re.sub(rf"_({'|'.join(_UNITS)})(?=_|$)", "", plain)
    plain = re.sub(r"\bp(\d\d)(?=[_,]|$)", r"\1th percentile", plain).replace("_", " ").strip()
    plain = re.sub(r"\b(snr|thd|fsr)\b", lambda m: m[1].upper(), plain)
    return plain[:1].upper() + plain[1:]


def unit_of(name: str, error_unit: str = "") -> str:
    """Return the unit at the end of a figure's name; "" if it has none.

    `error_unit` is that of the error of its part: other errors in % are of the same whole.

    >>> unit_of("full_scale_n"), unit_of("error_percent_2"), unit_of("sensors"), unit_of("mean_mm_at_150_n")
    ('N', '%', '', 'mm')
    >>> unit_of("distortion_2_percent"), unit_of("at_50_hz_db")
    ('%', 'dB')
    >>> [unit_of(f"{name}_percent", "% of full scale") for name in ("hysteresis", "spread")]
    ['% of full scale', '%']
    """
    if error_unit.startswith("%") and _ERRORS.search(name):
        return error_unit
    found = re.search(rf"_({'|'.join(_UNITS)})(?=_|$)", re.sub(r"_\d+_(n|hz)(?=_|$)", "", name))
    return _UNITS[found[1]] if found else ""
