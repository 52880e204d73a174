"""The columns that a table of trials has of its own."""

FIRST_COLUMNS = ("participant", "stage", "method", "practice", "trial", "block", "attempt", "spoiled")
"""The columns that every trial has, in their order."""
NOT_FACTORS = frozenset(
    (
        *FIRST_COLUMNS,
        *(
            "entry",
            "stages_row",
            "block_row",
            "correct",
            "right",
            "stimulus",
            "other",
            "gain_db",
            "comparison",
            "comparison_at",
            "judged_more",
            "staircase",
            "run",
        ),
        *("level_db", "catch", "announced", "width_m", "distance_m", "bearing_rad", "x_m", "y_m"),
        *("number", "answer", "interval", "felt", "rating", "magnitude", "label", "sort", "selected", "time_s"),
        *("started_at", "onset_s", "onset_after_step_s", "shown_s", "response_s", "plays", "frames", "commanded_m_s2"),
        *("most_force_n", "latency_s", "software", "measured_m_s2", "answered_by", "foot_after_s"),
    )
)
"""Columns that are not factors of stimuli: identification, answers and measurements of a trial."""
