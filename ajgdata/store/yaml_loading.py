"""How YAML is read: PyYAML's safe loaders, in C where the text is sure not to crash that.

Both give the same values, but that in C (libyaml) is more lenient with tabs and with `?` in flow
collections, and that in Python with `%YAML 1.0`. What is asked of a text is thus asked of the
loader that will read it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeAlias, TypeVar

import yaml

#: The loader in C takes 300 bytes of stack a level, and crashes where there is no more.
QUICK_LEVELS = 2000
#: Each level of nesting takes one of these characters.
NESTING = "[{:?-"


class _Strict:
    """What is added to a safe loader: a key that stands twice is refused (the first would be
    ignored), and so is nesting deeper than Python's stack, as values are made depth first."""

    def __init__(self, text: str) -> None:
        super().__init__(text)  # type: ignore[call-arg]
        self.deep_construct = True

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen:
                    problem = f"key {key.value!r} stands twice"
                    raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep=deep)  # type: ignore[misc]


class PythonLoader(_Strict, yaml.SafeLoader):
    """The loader for any text."""


class QuickLoader(_Strict, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same in C, ten times as fast, where PyYAML was built with libyaml."""


Loader: TypeAlias = PythonLoader | QuickLoader
Read = TypeVar("Read")


def yaml_value(text: str) -> Any:
    """Return what the only document of `text` says.

    Raises YAMLError (in the words of the loader in Python, which names the characters), ValueError
    for a date that there is not, RecursionError for nesting that is too deep.
    """
    return _read(text, lambda loader: loader.get_single_data())


def yaml_node(text: str) -> yaml.Node | None:
    """Return that document as nodes, which know their lines; raises as `yaml_value` does."""
    return _read(text, lambda loader: loader.get_single_node())


def has_aliases(text: str) -> bool:
    """Return True if YAML repeats parts of itself (`*name`): some lines can thus mean gigabytes.

    It does if any loader that may read the text meets an alias, be it before an error.
    """
    for kind in _loaders(text):
        with suppress(yaml.YAMLError):
            if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, Loader=kind)):
                return True
    return False


def levels(text: str) -> int:
    """Return how deep a text can be nested at most."""
    return sum(map(text.count, NESTING))


def _loaders(text: str) -> list[type[Loader]]:
    """Return the loaders that may read a text: each but the last leaves to the next what it
    refuses."""
    return [QuickLoader, PythonLoader] if levels(text) <= QUICK_LEVELS else [PythonLoader]


def _read(text: str, read: Callable[[Loader], Read]) -> Read:
    """Return what `read` makes of the first loader that reads the text; the last one's errors."""
    *others, last = _loaders(text)
    for kind in others:
        with suppress(yaml.YAMLError):
            return _read_by(kind, text, read)
    return _read_by(last, text, read)


def _read_by(kind: type[Loader], text: str, read: Callable[[Loader], Read]) -> Read:
    loader = kind(text)
    try:
        return read(loader)
    finally:
        loader.dispose()
