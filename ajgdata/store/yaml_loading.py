"""How YAML is read: PyYAML's safe loaders, in C where the text is sure not to crash that."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

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


def yaml_value(text: str) -> Any:
    """Return what the only document of `text` says.

    Raises YAMLError (in the words of the loader in Python, which names the characters), ValueError
    for a date that there is not, RecursionError for nesting that is too deep.
    """
    if levels(text) <= QUICK_LEVELS:
        with suppress(yaml.YAMLError):
            return _loaded(QuickLoader, text)
    return _loaded(PythonLoader, text)


def yaml_node(text: str) -> yaml.Node | None:
    """Return that document as nodes, which know their lines; raises as `yaml_value` does."""
    loader = (QuickLoader if levels(text) <= QUICK_LEVELS else PythonLoader)(text)
    try:
        return loader.get_single_node()
    finally:
        loader.dispose()


def levels(text: str) -> int:
    """Return how deep a text can be nested at most."""
    return sum(map(text.count, NESTING))


def _loaded(kind: type[PythonLoader | QuickLoader], text: str) -> Any:
    loader = kind(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()
