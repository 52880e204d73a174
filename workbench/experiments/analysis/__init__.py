"""Analysis of trials: estimates with intervals per participant, tests over participants, and results of the thesis for
comparison.

Statistics come from SciPy and statsmodels; only transmitted information, corrected for few trials, and psychometric
curves, of which a bootstrap fits hundreds at once, are computed here.
`findings` holds the results of an analysis, and `analyses` selects the analysis of a method. Each method has its own
module.
"""
