"""Fibre bundle models: `bundle.FibreBundle`, `grid.FibreGrid` and `local_load_sharing.ring` for scripts."""
