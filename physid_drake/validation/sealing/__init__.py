"""Hides the truth of worlds from their diagnosis: seals, secrets, and a process of its own for each diagnosis."""
