"""What trials say: estimates of each person with intervals, tests over people, and the thesis's own results beside.

Statistics come from SciPy and statsmodels; only transmitted information, corrected for few trials, is computed here.
`findings` is what an analysis gives; `analyses` finds the one of a method; each method has a file of its own.
"""
