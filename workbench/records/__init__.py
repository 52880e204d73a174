"""Sessions on disk and the tables that commands write."""
