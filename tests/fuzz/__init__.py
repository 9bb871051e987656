"""Inputs made by small grammars, for all that reads what somebody else wrote: `harness.run` runs and counts them.

One file per kind of input makes them from ``(seed, index)`` alone: ``tables``, ``recordings``, ``meshes``,
``configurations``, ``models``, ``folders``, ``proofs``, ``sources``, ``logs``, ``commands``. ``trees`` and ``damage``
hold what they share, ``watch`` sees what is read and written, and ``worker`` runs one input after the other in a
process that ``harness`` ends where it is silent.
"""
