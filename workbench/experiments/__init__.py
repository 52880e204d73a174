"""Experiments on people: protocols, methods, simulated participants, sessions on disk, and what comes of them.

`protocol` is the document, `methods` decide what is asked next, a class in a file each, `study` goes through the pages
of a protocol and takes answers, `observers` are simulated participants whose truth is known, `store` keeps every answer
the moment it is given, and `analysis` says what all of it says. Nothing here has a screen or starts the engine.
"""
