"""Results of the thesis "Walking on virtual ground", for comparison with new ones.

Tables and figures have the thesis's numbers; where it contradicts itself, the values are from its data.
"""

IDENTIFIED_MEAN, IDENTIFIED_SD, CHANCE = 0.61, 0.21, 0.125
"""Rates of correct identification over 24 people and both sets (3.4.2), and the rate of guessing."""
LEAST_CONFUSED, MOST_CONFUSED = 0.80, 0.25
"""Rates of the best and of the worst stimulus (3.4.2)."""
IMPACT_LABELS = {"IT": 0.58, "WS": 0.18}
"""Share of stimuli in each set that were labelled as impacts (3.4.2)."""

SETS = ("WS", "IT")
"""The sets of tactons (3.4)."""

STIMULI = tuple(waveform + envelope for waveform in "SWT" for envelope in "CPD")
"""The stimuli that were made equally intense (table 6.1)."""
RATED_FACTORS = ("waveform", "envelope", "amplitude")
"""The factors of the conditions whose compliance was rated (6.4.1)."""

STIFFNESS_N_MM = (52.0, 64.0, 76.0, 90.0, 106.0, 124.0, 146.0)
LEVELS_M_S2 = (0.0, 0.43, 0.86)
JUDGED_STIFFER = {
    0.0: (0.034, 0.13, 0.33, 0.557, 0.64, 0.69, 0.77),
    0.43: (0.010, 0.078, 0.18, 0.29, 0.37, 0.46, 0.49),
    0.86: (0.0068, 0.042, 0.13, 0.17, 0.22, 0.28, 0.36),
}
"""Table 6.2: mean share of comparisons judged stiffer than 90 N/mm, by stiffness, at each level."""
PSE_N_MM = {0.0: 100.8, 0.43: 134.5, 0.86: 151.6}
SLOPE_MM_N = {0.0: 0.025, 0.43: 0.018, 0.86: 0.018}
INTERCEPT = {0.0: -2.50, 0.43: -2.70, 0.86: -2.77}
"""Table 6.3: medians over 20 people, at each level."""

THRESHOLD_M_S2, THRESHOLD_SD_M_S2 = 0.46, 0.18
"""Detection of TD: mean and standard deviation over 20 people (6.4.2)."""
FALSE_ALARMS_MEDIAN = 1.5
"""How often people said yes to nothing, of catch trials (6.3.6)."""

WIDTHS_M = (0.045, 0.165)
"""The smallest and the largest button (5.6.1)."""
SELECTED_LARGEST, SELECTED_SMALLEST = 0.98, 0.44
"""Rates of selection of the largest and the smallest button (5.6.1)."""
SELECTION_LOGIT = "z = 1.4 + 0.071 w - 0.062 d - 0.6 theta, w and d in cm, theta in rad"
"""As printed (5.6.1): it contradicts the rates above, and is quoted only."""
NEAR_AND_FAR = "Thesis 5.6.1: 84 % at 15 cm, 98.5 % at 25 cm, p < 0.001"
"""Rates of selection at two distances, by Fisher's exact test (5.6.1)."""
