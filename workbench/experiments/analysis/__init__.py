"""Analysis of trials: estimates with intervals per person, tests over people, and the thesis's results beside them.

Statistics come from SciPy and statsmodels; only transmitted information, corrected for few trials, is computed here.
`findings` holds the results of an analysis; `analyses` selects the one of a method; each method has a file of its own.
"""
