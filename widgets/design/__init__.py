"""The Design workspace: palette, canvas, inspector and preview of one patch."""
