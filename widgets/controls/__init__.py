"""Controls made from a parameter's declaration; each edits a value and knows nothing of where it goes."""
