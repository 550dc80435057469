"""Templates place values: they neither compute nor decide, except whether a value is present."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from jinja2 import nodes

from ajgdata.paths import Paths
from ajgdata.report.render import environment

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "reports/templates"
TEMPLATES = sorted(path.name for path in FOLDER.glob("*.j2"))
#: Nodes of a template that place values, texts and parts of other templates.
PLACING = (
    nodes.Template,
    nodes.Output,
    nodes.TemplateData,
    nodes.Extends,
    nodes.Include,
    nodes.FromImport,
    nodes.Block,
    nodes.Macro,
    nodes.CallBlock,
    nodes.Call,
    nodes.Name,
    nodes.Getattr,
    nodes.Const,
    nodes.For,
    nodes.If,
    nodes.Tuple,
)
#: A value of a page, whose presence may decide, or over which a loop runs.
VALUES = (nodes.Name, nodes.Getattr)
#: Filters by template. `cell` keeps a text inside a cell of Markdown, as escaping does in HTML.
FILTERS = {"card.md.j2": {"cell"}, "model_card.md.j2": {"cell"}}


def all_nodes(node: nodes.Node) -> Iterator[nodes.Node]:
    yield node
    for child in node.iter_child_nodes():
        yield from all_nodes(child)


def parsed(text: str) -> list[nodes.Node]:
    return list(all_nodes(environment(Paths(ROOT)).parse(text)))


def only_places(node: nodes.Node, filters: set[str]) -> bool:
    match node:
        case nodes.Filter():
            return node.name in filters
        case nodes.If():
            return isinstance(node.test, VALUES)
        case nodes.For():
            return node.test is None and isinstance(node.iter, VALUES)
        case nodes.Call():  # of a macro, not of a method
            return isinstance(node.node, nodes.Name)
        case nodes.Tuple():  # the names of a loop, not a list of values
            return node.ctx == "store"
        case _:
            return isinstance(node, PLACING)


def decisions(text: str, filters: set[str]) -> list[str]:
    """Return the line and type of each node that computes or decides."""
    return [
        f"line {node.lineno}: {type(node).__name__}"
        for node in parsed(text)
        if not only_places(node, filters)
    ]


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_computes_nothing(name):
    text = (FOLDER / name).read_text(encoding="utf-8")
    assert decisions(text, FILTERS.get(name, set())) == []


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_calls_only_macros(name):
    """A call of a value of the page would hide a computation."""
    contents = parsed((FOLDER / name).read_text(encoding="utf-8"))
    macros = {node.name for node in contents if isinstance(node, nodes.Macro)}
    for node in contents:
        if isinstance(node, nodes.FromImport):
            macros |= set(node.names)
    called = {node.node.name for node in contents if isinstance(node, nodes.Call)}
    assert called <= macros | {"caller"}


@pytest.mark.parametrize(
    "text",
    [
        "{{ a + 1 }}",
        "{{ 'b' ~ a }}",
        "{{ a[:10] }}",
        "{{ a[0] }}",
        "{{ 'one' if a }}",
        "{{ a | length }}",
        "{{ '{:,}'.format(a) }}",
        "{% set b = a %}",
        "{% if a == 1 %}b{% endif %}",
        "{% if not a %}b{% endif %}",
        "{% if a and b %}c{% endif %}",
        "{% for b in a if b %}c{% endfor %}",
        "{% for b in a.items() %}c{% endfor %}",
        "{% for b in [1, 2] %}c{% endfor %}",
    ],
)
def test_a_computation_is_found(text):
    assert decisions(text, set()) != []
