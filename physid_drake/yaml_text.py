"""YAML as people write it: one line says what is wrong with it, whatever that is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import yaml

from physid_drake.errors import ConfigError
from physid_drake.files import FileError, read_text
from physid_drake.wording import named, one_line

# A date of no calendar, a tag that does not fit its value, and a thousand brackets are no YAMLError.
NO_YAML = (yaml.YAMLError, ValueError, TypeError, AttributeError, LookupError, RecursionError, OverflowError)
WHOLE = re.compile(r"[-+]?(0|[1-9][0-9_]*|0x[0-9a-fA-F_]+)")
MOST_BYTES: Final = 2_000_000  # of a text: what people write has thousands
MOST_NODES: Final = 10_000  # of a text whose aliases are written out
MOST_PLAIN: Final = 200_000  # of a text without aliases: a thousand pushes with notes have four thousand
MOST_LETTERS: Final = 1000  # of a number
DEEPEST: Final = 100  # brackets in brackets; the scanner takes longer with every one that is open


class Loader(yaml.SafeLoader):
    """YAML in which nothing is there twice, and no number is another than it looks."""

    most_nodes = MOST_NODES
    nodes = 0

    def fetch_flow_collection_start(self, TokenClass: Any) -> None:
        """An opening bracket, of which only so many may be open."""
        if self.flow_level >= DEEPEST:
            message = f"more than {DEEPEST} brackets are open"
            raise yaml.scanner.ScannerError(None, None, message, self.get_mark())
        super().fetch_flow_collection_start(TokenClass)

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """A node, of which there may only be so many."""
        self.nodes += 1
        if self.nodes > self.most_nodes:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, f"it holds more than {self.most_nodes} values", mark)
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping, in which no key stands twice."""
        seen: set[str] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.value == "<<":
                continue
            if key.value in seen:
                message = f"key '{named(key.value)}' is there twice"
                raise yaml.constructor.ConstructorError(None, None, message, node.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep=deep)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """YAML 1.1 takes 010 for 8 and 1:30 for 90."""
        text = str(node.value)
        if not WHOLE.fullmatch(text) or len(text) > MOST_LETTERS:
            message = f"'{named(text)}' is no number in base 10"
            raise yaml.constructor.ConstructorError(None, None, message, node.start_mark)
        return int(super().construct_yaml_int(node))


class PlainLoader(Loader):
    """The same without aliases, for what programs write: nothing in it stands for something elsewhere."""

    most_nodes = MOST_PLAIN

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """A node, which is neither named nor the name of another."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if getattr(event, "anchor", None) is not None:
            message = f"the anchor or alias '{named(event.anchor)}' is not read here; write its value out"
            raise yaml.composer.ComposerError(None, None, message, event.start_mark)
        return super().compose_node(parent, index)


for _loader in (Loader, PlainLoader):
    _loader.add_constructor("tag:yaml.org,2002:int", _loader.construct_yaml_int)


def parsed(text: str, where: str, *, aliases: bool = True) -> Any:
    """The content of a YAML text.

    Args:
        text: YAML.
        where: it is from, for the message.
        aliases: whether anchors, aliases and merge keys are read; written out, they are 10,000 values at most.

    Raises:
        ConfigError: if it is no YAML, or too large.
    """
    try:
        loader = (Loader if aliases else PlainLoader)(text)
        node = loader.get_single_node()
        if node is None:
            return None
        if aliases:
            check_size(node)
        return loader.construct_document(node)
    except NO_YAML as error:
        raise ConfigError(f"{where}: is no YAML: {cause(error)}.") from error


def read_yaml(path: Path, where: str, *, aliases: bool = True) -> Any:
    """The content of a YAML file.

    Args:
        path: of the file.
        where: it is from, for the message.
        aliases: whether anchors, aliases and merge keys are read; written out, they are 10,000 values at most.

    Raises:
        ConfigError: if it is not there, cannot be read, or is no YAML.
    """
    try:
        text = read_text(path, most=MOST_BYTES)
    except FileError as error:
        raise ConfigError(f"{where}: {error}.") from error
    return parsed(text, where, aliases=aliases)


def cause(error: Exception) -> str:
    """What is wrong, and on which line where that is known."""
    if isinstance(error, yaml.reader.ReaderError):
        return f"its character number {error.position + 1} is U+{error.character:04X}, which no YAML may hold"
    if not isinstance(error, yaml.MarkedYAMLError):
        return one_line(error)
    mark = error.problem_mark or error.context_mark
    problem = named(error.problem or error.context)
    return problem if mark is None else f"{problem} (line {mark.line + 1})"


def check_size(root: yaml.Node) -> None:
    """Refuse a text that stands for too much: nine lists of nine aliases each are a billion values.

    Every node is counted once and its size remembered, so that this takes as long as the text is.

    Raises:
        ComposerError: if it has more than 10,000 values with its aliases written out, or holds itself.
    """
    sizes: dict[int, int] = {}
    entered: set[int] = set()
    waiting = [root]
    while waiting:
        node = waiting[-1]
        if id(node) in sizes:
            waiting.pop()
            continue
        inner = _inner(node)
        if id(node) not in entered:
            entered.add(id(node))
            waiting.extend(one for one in inner if id(one) not in sizes)
            if any(id(one) in entered and id(one) not in sizes for one in inner):
                raise yaml.composer.ComposerError(None, None, "an alias stands inside of what it names", None)
            continue
        waiting.pop()
        sizes[id(node)] = 1 + sum(sizes[id(one)] for one in inner)
        if sizes[id(node)] > MOST_NODES:
            message = f"it holds more than {MOST_NODES} values with its aliases written out; leave some out"
            raise yaml.composer.ComposerError(None, None, message, node.start_mark)


def _inner(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [one for pair in node.value for one in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []
