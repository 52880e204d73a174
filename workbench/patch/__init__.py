"""The patch: what a node declares, the document, and the program that a document becomes."""
