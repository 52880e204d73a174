"""The Calibrate workspace: any procedure, one page a step, and what is known of each tile."""
