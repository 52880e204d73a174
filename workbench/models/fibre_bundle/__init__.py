"""Fibres that share a load and break: `bundle.bundle`, `grid.grid` and `local_load_sharing.ring` for scripts."""
