"""All that has a screen. Widgets edit values and know of no process; `bridge` alone binds them to the engine."""
