"""Linear filters in real time: second-order sections, cascades, sums of poles, and equaliser design."""
