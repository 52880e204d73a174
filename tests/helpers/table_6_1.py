"""The thesis's measurements of its nine stimuli (table 6.1)."""

TABLE_6_1 = {
    "sc": (2.9, 1.74),
    "sp": (3.7, 2.4),
    "sd": (6.8, 4.4),
    "wc": (17.4, 10.9),
    "wp": (18.4, 8.5),
    "wd": (18.2, 10.9),
    "tc": (3.3, 1.2),
    "tp": (4.6, 1.75),
    "td": (6.8, 2.4),
}
"""Peak and RMS acceleration at A = 1, m/s^2."""
