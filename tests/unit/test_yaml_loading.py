"""Either loader gives the same values, and neither crashes; each is more lenient in some places,
which are listed here."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.store import yaml_loading
from ajgdata.store.yaml_loading import (
    QUICK_LEVELS,
    PythonLoader,
    QuickLoader,
    has_aliases,
    levels,
    yaml_node,
    yaml_value,
)

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(
    [
        *ROOT.glob("datasets/*/*.yaml"),
        *ROOT.glob("reports/*.yaml"),
        *ROOT.glob("workflow/**/*.yaml"),
    ]
)
REFUSED = [
    "a: 1\na: 2", "{a: {b: 1, 'b': 2}}", "x: !!python/object/apply:os.system [x]", "\ta: 1",
    "a: b: c", "a: @x", "a: *there_is_none", "a: &x [*x]", "? [1, 2]\n: 3", "a: [1, 2",
    "a: 1\n---\nb: 2", "a: \x07",
]  # fmt: skip
#: What libyaml reads and Python refuses: tabs that separate, and `?` inside of flow collections.
LENIENT = {
    "a: 1 \t": {"a": 1}, "a: b\t#c": {"a": "b"}, "'a'\t: 1": {"a": 1}, "[1,\t2]": [1, 2],
    "a:\t\n  b: 1": {"a": {"b": 1}}, "a:\tb": {"a": "b"},
    "{a: http://x?y}": {"a": "http://x?y"}, "[a?b]": ["a?b"],
}  # fmt: skip
#: What Python reads and libyaml refuses.
OLD = "%YAML 1.0\n---\nname: x\nother: y\n"
#: Nine lines that mean 10^9 elements.
BOMB = "a0: &a0 [" + "x, " * 9 + "x]\n" + "".join(
    f"a{n}: &a{n} [" + f"*a{n - 1}, " * 9 + f"*a{n - 1}]\n" for n in range(1, 9)
)  # fmt: skip
DEEP = ["a: " + "[" * 900 + "]" * 900, "{a: " * 3000, "- " * 20_000, "? " * 5000, "[" * 100_000]


def read_by(kind, text):
    loader = kind(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def test_libyaml_is_used_here():
    assert yaml.__with_libyaml__
    assert issubclass(QuickLoader, yaml.CSafeLoader)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_of_the_project_reads_the_same(path):
    text = path.read_text()
    assert read_by(QuickLoader, text) == read_by(PythonLoader, text) == yaml.safe_load(text)
    assert levels(text) <= QUICK_LEVELS


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text()
    | st.dates()
    | st.sampled_from(["1e3", "0o7", "yes", "~", "12:30:00", "=", "<<", "- x", "a: b", "\ufeff"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=60, deadline=None)
@given(value=VALUES, flow=st.booleans())
def test_what_was_written_is_read_back(value, flow):
    text = yaml.safe_dump(value, default_flow_style=flow, allow_unicode=True)
    assert yaml_value(text) == read_by(QuickLoader, text) == read_by(PythonLoader, text)


@pytest.mark.parametrize("text", REFUSED)
def test_both_refuse_and_the_words_are_those_of_python(text):
    said = []
    for kind in (PythonLoader, QuickLoader):
        with pytest.raises(yaml.YAMLError) as caught:
            read_by(kind, text)
        said.append(str(caught.value))
    with pytest.raises(yaml.YAMLError) as caught:
        yaml_value(text)
    assert str(caught.value) == said[0]


@pytest.mark.parametrize("text", DEEP, ids=lambda text: text[:5])
def test_deep_nesting_is_an_error_and_no_crash(text):
    with pytest.raises(RecursionError):
        yaml_value(text)


def test_text_that_may_be_deep_is_left_to_python(monkeypatch):
    monkeypatch.setattr(yaml_loading, "QuickLoader", None)  # whoever calls it fails
    marks = "'" + "-" * QUICK_LEVELS + "'"
    assert yaml_value(f"a: {marks}") == {"a": "-" * QUICK_LEVELS}
    assert yaml_node(f"a: {marks}").value[0][1].value == "-" * QUICK_LEVELS


@pytest.mark.parametrize("text", LENIENT)
def test_tabs_and_question_marks_are_read_more_leniently_than_by_python(text):
    assert yaml_value(text) == read_by(QuickLoader, text) == LENIENT[text]
    with pytest.raises(yaml.YAMLError):
        read_by(PythonLoader, text)


def test_what_only_python_reads_is_read_and_has_its_nodes():
    with pytest.raises(yaml.YAMLError):
        read_by(QuickLoader, OLD)
    assert yaml_value(OLD) == {"name": "x", "other": "y"}
    lines = [key.start_mark.line for key, _ in yaml_node(OLD).value]
    assert lines == [2, 3]


LONG = "# " + "-" * QUICK_LEVELS + "\n"  # left to Python


@pytest.mark.parametrize(
    "before", ["", LONG, "name:\tx\n", "u: {v: http://x?y}\n", "%YAML 1.0\n---\n"]
)
def test_aliases_are_found_by_the_loader_that_reads_the_text(before):
    assert yaml_value(before + BOMB)["a0"] == ["x"] * 10
    assert has_aliases(before + BOMB)
    assert not has_aliases(before + "a: &a [x, '*a', b*c]\n")


def test_a_text_that_nothing_reads_is_no_alias():
    assert not has_aliases("a: [")
