"""Exchange of patches with other programs. Each format is a file of `formats/`; `FORMATS` finds them all."""
