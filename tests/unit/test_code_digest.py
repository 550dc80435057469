"""A rule is stale after an edit of anything that its function may use, and of nothing else."""

import ast
import re
import shutil
from pathlib import Path

import pytest

from ajgdata.store.code_digest import Code, code_digest

PACKAGE = Path(__file__).resolve().parents[2] / "ajgdata"
RULES = Path(__file__).resolve().parents[2] / "workflow/rules"


@pytest.fixture
def code(tmp_path):
    """Sources in a folder that a test may edit: `code(text by file)` writes them."""

    def written(**files):
        for name, text in files.items():
            path = tmp_path / "pkg" / f"{name.replace('__in__', '/')}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return Code({"pkg": tmp_path / "pkg"})

    return written


MEASURE = '''"""Doc."""
from pkg.tools import scaled, unused
from pkg import shapes
import pkg.other as other

SIZE = 3  # mm
REGISTRY = {}
REGISTRY["x"] = 1

def measure(x):
    """Doc."""
    from pkg.late import late
    return scaled(x) + shapes.area(SIZE) + late() + other.thing.part

def figure():
    return unused()
'''
FILES = {
    "__init__": "",
    "measure": MEASURE,
    "tools": "def scaled(x):\n    return _half(x)\ndef _half(x):\n    return x / 2\n"
    "def unused():\n    return 1\n",
    "shapes": "class Base:\n    a = 1\nclass Box(Base):\n    b = 2\ndef area(x):\n"
    "    return Box() and x\n",
    "late": "def late():\n    return 'pkg.named:chosen', 'pkg.group'\n",
    "group": "def member():\n    return 1\n",
    "named": "def chosen():\n    return 1\ndef not_chosen():\n    return 2\n",
    "other": "thing = 5\nelse_ = 6\n",
}


@pytest.mark.parametrize(
    ("file", "old", "new", "counts"),
    [
        ("measure", "return scaled(x)", "return 2 * scaled(x)", True),
        ("measure", "SIZE = 3", "SIZE = 4", True),
        ("measure", '["x"] = 1', '["x"] = 2', True),  # a registration always counts
        ("measure", "return unused()", "return 0", False),
        ("measure", "# mm", "# millimetres", False),
        ("measure", "Doc.", "Other words.", False),
        ("measure", "def figure", "\n\n\ndef figure", False),
        ("tools", "return x / 2", "return x / 3", True),  # a private function of an imported one
        ("tools", "return 1", "return 2", False),
        ("shapes", "a = 1", "a = 2", True),  # a base class
        ("shapes", "b = 2", "b = 3", True),
        ("late", "def late():", "def late(*, x=1):", True),  # imported inside a function
        ("named", "return 1", "return 3", True),  # named by a text
        ("named", "return 2", "return 3", False),
        ("group", "return 1", "return 2", False),  # a text may be anything
        ("other", "thing = 5", "thing = 7", True),
        ("other", "else_ = 6", "else_ = 7", False),
    ],
)
def test_an_edit_counts_if_it_is_reached(code, file, old, new, counts):
    before = code(**FILES).digest("pkg.measure:measure")
    assert old in FILES[file]
    edited = code(**{file: FILES[file].replace(old, new)})
    assert (edited.digest("pkg.measure:measure") != before) is counts


def test_packages_re_export_and_hide_imports(code):
    files = {
        "__init__": "from pkg.inner import name\n",
        "inner__in____init__": "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from pkg.inner.lazy import lazy\n"
        "from .near import name\n"
        "try:\n    from pkg.inner.fast import quick\nexcept ImportError:\n    quick = None\n"
        "def __getattr__(name):\n    return name\n",
        "inner__in__near": "from ..base import *\ndef name():\n    return deep()\n",
        "inner__in__lazy": "def lazy():\n    return 1\n",
        "inner__in__fast": "def quick():\n    return 1\n",
        "base": "def deep():\n    return 1\n",
        "entry": "import pkg\nfrom pkg import inner\n"
        "def a():\n    return pkg.name()\ndef b():\n    return inner.lazy\n"
        "def c():\n    return inner.quick()\ndef d():\n    return getattr(inner, 'x')\n",
    }
    sources = code(**files)
    assert sources.reached("pkg.entry:a") == {
        "pkg": {""},
        "pkg.inner": {""},
        "pkg.inner.near": {"", "name"},
        "pkg.base": {"", "deep"},
        "pkg.entry": {"", "a"},
        "pkg.inner.fast": {"", "quick"},  # which the `try` imports
    }
    assert "lazy" in sources.reached("pkg.entry:b")["pkg.inner.lazy"]
    assert "quick" in sources.reached("pkg.entry:c")["pkg.inner.fast"]
    whole = sources.reached("pkg.entry:d")
    assert {"pkg.inner.lazy", "pkg.inner.near", "pkg.inner.fast"} <= set(whole)
    assert "__getattr__" in whole["pkg.inner"]


def test_what_does_not_exist_is_said(code):
    sources = code(**FILES)
    for entry in ("pkg.measure:absent", "pkg.absent:x", "pkg/absent.yaml"):
        with pytest.raises(ValueError, match=r"there is no .*absent"):
            sources.digest(entry)
    with pytest.raises(ValueError, match="there is no package absent_package"):
        code_digest("absent_package.measure:measure")


def test_data_files_count(code, tmp_path):
    sources = code(**FILES)
    (tmp_path / "pkg/data.yaml").write_text("a: 1\n")
    before = sources.digest("pkg.measure:figure", "pkg/data.yaml")
    (tmp_path / "pkg/data.yaml").write_text("a: 2\n")
    assert sources.digest("pkg.measure:figure", "pkg/data.yaml") != before


def test_another_package_is_followed_and_so_is_what_it_uses_of_ours(tmp_path, monkeypatch):
    (tmp_path / "plug_in.py").write_text(
        "from ajgdata.evaluate.metrics import classification_metrics\n"
        "def measure(x):\n    return helper(x)\ndef helper(x):\n    return 1\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    before = code_digest("plug_in:measure")
    text = (tmp_path / "plug_in.py").read_text()
    (tmp_path / "plug_in.py").write_text(text.replace("return 1", "return 2"))
    other = Code({"plug_in": tmp_path / "plug_in.py", "ajgdata": PACKAGE})
    assert other.digest("plug_in:measure") != before
    assert "plug_in" in other.reached("plug_in:measure")


def entries_of_rules():
    text = "".join(path.read_text() for path in sorted(RULES.glob("*.smk")))
    return sorted(set(re.findall(r'"(ajgdata\.[\w.]+:\w+)"', text)))


ENTRIES = entries_of_rules()
#: Those whose closures lie in different parts of the package.
TRIED = [e for e in ENTRIES if e.split(":")[1] in ("train_models", "extract_features", "merge")]


def edited(text, name):
    """A source whose definition `name` does something more."""
    for node in ast.parse(text).body:
        if getattr(node, "name", None) == name:
            first = node.body[0]
            lines = text.splitlines(keepends=True)
            spaces = " " * first.col_offset
            if first.lineno == node.lineno:
                return None  # `class A: ...`
            lines.insert(first.lineno - 1, f"{spaces}ADDED_BY_A_TEST = 1\n")
            return "".join(lines)
    return None


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    target = tmp_path_factory.mktemp("sources") / "ajgdata"
    shutil.copytree(PACKAGE, target, ignore=shutil.ignore_patterns("__pycache__"))
    return target


def test_rules_name_functions_that_exist():
    assert len(ENTRIES) >= 10
    assert len(TRIED) == 3
    for entry in ENTRIES:
        assert code_digest(entry)


@pytest.mark.parametrize("entry", TRIED)
def test_one_line_in_any_reached_module_makes_a_rule_stale(copied, entry):
    """And none in a module that is not reached does."""
    sources = Code({"ajgdata": copied})
    reached, before = sources.reached(entry), sources.digest(entry)
    tried = 0
    for module, names in reached.items():
        path = next(
            file
            for stem in [copied.joinpath(*module.split(".")[1:])]
            for file in (stem.with_suffix(".py"), stem / "__init__.py")
            if file.is_file()
        )
        text = path.read_text()
        changes = [one for name in sorted(names) if (one := edited(text, name))]
        for changed in changes[:1]:
            path.write_text(changed)
            assert Code({"ajgdata": copied}).digest(entry) != before, module
            path.write_text(text)
            tried += 1
    assert tried >= 2
    unreached = [
        path
        for path in sorted(copied.rglob("*.py"))
        if ".".join(["ajgdata", *path.relative_to(copied).with_suffix("").parts]) not in reached
        and path.stem != "__init__"
    ]
    for path in unreached:
        path.write_text(path.read_text() + "\n\ndef added_by_a_test():\n    pass\n")
    assert Code({"ajgdata": copied}).digest(entry) == before
    for path in unreached:
        path.write_text((PACKAGE / path.relative_to(copied)).read_text())


def test_what_hand_written_lists_had_missed():
    code = Code({"ajgdata": PACKAGE})
    train = code.reached("ajgdata.pipeline.train:train_models")
    assert "task_data" in train["ajgdata.evaluate.task_data"]
    assert "ajgdata.models.cnn" in train  # named by a text in the registry
    features = code.reached("ajgdata.pipeline.extract_features:extract_features")
    assert "write_findings" in features["ajgdata.store.findings"]
    assert not {"ajgdata.report.canvas", "ajgdata.paths"} & (set(train) | set(features))


def test_a_figure_is_of_the_report_and_of_no_measurement():
    code, module = Code({"ajgdata": PACKAGE}), "ajgdata.experiments.learning_curve"
    measured = code.reached("ajgdata.pipeline.experiments:run_experiment", f"{module}:measure")
    assert "measure" in measured[module] and "figure" not in measured[module]
    assert not [name for name in measured if name.startswith("ajgdata.report")]
    drawn = code.reached("ajgdata.pipeline.report:build_report", module)
    assert {"figure", "caption", "paper_comparison"} <= drawn[module]


def test_what_is_imported_from_elsewhere_counts_and_a_type_that_is_only_said_does_not(tmp_path):
    package = tmp_path / "pkg"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "kinds.py").write_text("class Kind:\n    one = 1\n")
    text = (
        "from math import {} as f\nfrom pkg.kinds import Kind\ndef run(x: Kind):\n    return f(x)\n"
    )
    digests = []
    for name in ("sin", "cos"):
        (package / "mod.py").write_text(text.format(name))
        digests.append(Code({"pkg": package}).digest("pkg.mod:run"))
    assert digests[0] != digests[1]
    (package / "kinds.py").write_text("class Kind:\n    one = 2\n")
    assert Code({"pkg": package}).digest("pkg.mod:run") == digests[1]
