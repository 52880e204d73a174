"""Fibre bundle models: `bundle.FibreBundle` and `grid.FibreGrid` for scripts."""
