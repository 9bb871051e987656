"""Searches by the names that configurations and commands use."""

from collections.abc import Callable

from physid_drake.errors import ConfigError
from physid_drake.search.entropy_search import EntropySearch
from physid_drake.search.greedy_entropy import GreedyEntropySearch
from physid_drake.search.protocol import Search
from physid_drake.search.random_search import RandomSearch

SEARCHES: dict[str, Callable[[], Search]] = {
    "greedy_entropy": GreedyEntropySearch,
    "entropy_search": EntropySearch,
    "random": RandomSearch,
}


def search_named(name: str) -> Search:
    """A search with its usual numbers.

    Raises:
        ConfigError: if there is none of this name.
    """
    if name not in SEARCHES:
        raise ConfigError(f"search: '{name}' is unknown; known are {', '.join(SEARCHES)}.")
    return SEARCHES[name]()
