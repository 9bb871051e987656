"""Logs of one's own into recordings: tables of numbers and bags, explained by a map."""

from physid_drake.convert.convert import convert_bag, convert_table
from physid_drake.convert.guess import guess_map
from physid_drake.convert.map_reading import read_map
from physid_drake.convert.map_text import Guess
from physid_drake.convert.mapping import Map
from physid_drake.convert.take import pushes_of_take

__all__ = ["Guess", "Map", "convert_bag", "convert_table", "guess_map", "pushes_of_take", "read_map"]
