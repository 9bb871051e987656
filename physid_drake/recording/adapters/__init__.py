"""Converters from published layouts to ``physid-recording/1``."""

from physid_drake.recording.adapters.cmu import convert_cmu
from physid_drake.recording.adapters.cube import convert_cube
from physid_drake.recording.adapters.mit import convert_mit

__all__ = ["convert_cmu", "convert_cube", "convert_mit"]
