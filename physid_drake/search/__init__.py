"""Choosers of the next trial, and the loop that runs one of them to its end."""

from physid_drake.search.candidates import initial_design, refine_candidates
from physid_drake.search.entropy_search import EntropySearch
from physid_drake.search.greedy_entropy import GreedyEntropySearch
from physid_drake.search.loop import SearchResult, StopReason, search_minimum
from physid_drake.search.power import PowerResult, search_by_power
from physid_drake.search.protocol import Search
from physid_drake.search.random_search import RandomSearch
from physid_drake.search.registry import SEARCHES, search_named

__all__ = [
    "SEARCHES",
    "EntropySearch",
    "GreedyEntropySearch",
    "PowerResult",
    "RandomSearch",
    "Search",
    "SearchResult",
    "StopReason",
    "initial_design",
    "refine_candidates",
    "search_by_power",
    "search_minimum",
    "search_named",
]
