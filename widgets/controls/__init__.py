"""Controls made from the declaration of a parameter; each edits a value, independent of its use."""
