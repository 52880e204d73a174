"""Experiments with participants: protocols, methods, simulated participants, stored sessions and their analysis.

`protocol` is the study's document. Each module of `methods` holds one method, which selects the next trial. `study` is
the state machine of a session: it goes through the pages of a protocol and takes the answers. `observers` are simulated
participants with known parameters. `store` writes each answer to disk immediately. `analysis` computes the results. The
package needs no window and does not start the engine.
"""
