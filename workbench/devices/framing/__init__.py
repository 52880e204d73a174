"""What the bytes mean: the wire format, and the parser that finds samples in any stream of bytes."""
