"""Patches out to other programs and in from them. Each format is a file of `formats/`; `FORMATS` finds them all."""
