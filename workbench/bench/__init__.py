"""What it all costs and what it withstands: run time against error, stability under stress, and a large floor."""
