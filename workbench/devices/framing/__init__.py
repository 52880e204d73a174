"""Framing: the wire format, and the parser that finds samples in a stream of bytes."""
