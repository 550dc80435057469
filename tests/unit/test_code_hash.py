"""A result depends on the code that decides it, and on versions of libraries."""

import ast
import sys
from importlib.metadata import EntryPoint

import pytest

from ajgdata.store import code_hash as module
from ajgdata.store.code_hash import CODE, CodeSource, code_hash, used_sources
from ajgdata.store.syntax import deciding_tree, used_statements

FILES = {
    "gripper/scene.py": "GRIPPER = 1\n",
    "features/spectrum.py": '"""A spectrum."""\nimport numpy as np\nHOP = 512  # samples\n',
    "models/cnn.py": "LAYERS = 3\n",
    "store/scan.py": "SCAN = 1\n",
    "types/settings.py": (
        "class Settings:\n"
        '    """Settings."""\n'
        '    hop: int = Field(512, description="samples between frames")\n'
        "    def check(self):\n"
        "        if self.hop < 1:\n"
        '            raise ValueError(f"hop {self.hop} is too small", "too_small")\n'
    ),
    "pipeline/experiments.py": (
        "from ajgdata.store.files import read_json, write_bytes\n"
        "LIMIT = 2\n"
        "def run_experiment(x):\n"
        "    return read_json(x) * LIMIT\n"
        "def read_results(x):\n"
        "    return write_bytes(x)\n"
    ),
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with few files, instead of ours."""
    root = tmp_path / "ajgdata"
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    monkeypatch.setattr(module, "PACKAGE", root)
    forget()
    yield root
    forget()


def forget():
    for cached in (module.code_hash, module._digest, module._imports_of, deciding_tree):
        cached.cache_clear()


def changed_types(change):
    """Return the types of jobs whose hash `change()` changes."""
    before = {job_type: code_hash(job_type) for job_type in CODE}
    change()
    forget()
    return {job_type for job_type in CODE if code_hash(job_type) != before[job_type]}


def edit(package, file, old, new):
    """Return the types of jobs that an edit of a file concerns."""
    path = package / file
    text = path.read_text()
    assert text.count(old) == 1
    return changed_types(lambda: path.write_text(text.replace(old, new)))


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("features/spectrum.py", '"""A spectrum."""', '"""The spectrum of a recording."""'),
        ("features/spectrum.py", "# samples", "# samples between frames"),
        ("features/spectrum.py", "HOP = 512", "HOP  =  512"),
        ("types/settings.py", '"""Settings."""', '"""Settings of features."""'),
        ("types/settings.py", "samples between frames", "hop"),
        ("types/settings.py", "is too small", "must be positive"),
    ],
    ids=["docstring", "comment", "spaces", "docstring of a class", "description", "message"],
)
def test_text_for_people_decides_no_result(package, file, old, new):
    assert edit(package, file, old, new) == set()


def test_a_constant_concerns_the_jobs_that_use_its_file(package):
    job_types = edit(package, "features/spectrum.py", "512", "256")
    assert "features" in job_types and "acquire" not in job_types and "train" not in job_types
    assert edit(package, "store/scan.py", "1", "2") == set()
    assert "features" not in edit(package, "models/cnn.py", "3", "4")
    assert {"acquire", "gripper"} <= edit(package, "gripper/scene.py", "1", "2")


@pytest.mark.parametrize(
    ("old", "new"),
    [("self.hop < 1", "self.hop < 2"), ("too_small", "tiny"), ("ValueError", "TypeError")],
    ids=["condition", "code of the error", "class of the error"],
)
def test_an_error_decides_although_its_message_does_not(package, old, new):
    assert {"features", "experiment"} <= edit(package, "types/settings.py", old, new)


def test_of_a_named_definition_only_what_it_uses_decides(package):
    file = "pipeline/experiments.py"
    experiments = {job_type for job_type in CODE if job_type.startswith("experiment")}
    assert edit(package, file, "LIMIT = 2", "LIMIT = 3") == experiments
    assert edit(package, file, "return write_bytes(x)", "return x") == set()
    imports = "read_json, write_bytes", "write_bytes, read_json"
    assert edit(package, file, *imports) == set()


@pytest.mark.parametrize("library", ["scikit-learn", "umap-learn", "numpy", "soundfile", "numba"])
def test_a_version_of_a_library_concerns_the_jobs_that_use_it(package, monkeypatch, library):
    real = module.installed_version

    def upgrade():
        newer = lambda name: "99.0" if name == library else real(name)  # noqa: E731
        monkeypatch.setattr(module, "installed_version", newer)

    learning = (module.LEARNING, *module.EMBEDDING)
    unchanged = set(module.WITHOUT_MODELS) if library in learning else set()
    if library == "numba":
        unchanged = {"features", "sample", "collect", "publish"}
    assert changed_types(upgrade) == set(CODE) - unchanged


@pytest.mark.parametrize(
    ("models", "decides"),
    [
        (("knn", "linear"), False),
        (("knn", "cnn"), True),
        (("model_of_another_package",), True),
        (None, True),
    ],
)
def test_torch_decides_only_for_jobs_with_networks(package, monkeypatch, models, decides):
    """The installation of torch computes the results of the other models again otherwise."""
    real = module.installed_version
    before = code_hash("experiment", models=models), code_hash("train", models=models)
    newer = lambda name: "99.0" if name == "torch" else real(name)  # noqa: E731
    monkeypatch.setattr(module, "installed_version", newer)
    forget()
    after = code_hash("experiment", models=models), code_hash("train", models=models)
    assert [old != new for old, new in zip(before, after, strict=True)] == [decides, decides]


def test_a_copy_of_the_package_has_the_same_hash(package, tmp_path, monkeypatch):
    before = code_hash("features")
    copy = tmp_path / "elsewhere" / "ajgdata"
    copy.parent.mkdir()
    package.rename(copy)
    monkeypatch.setattr(module, "PACKAGE", copy)
    forget()
    assert code_hash("features") == before


def test_a_name_includes_what_it_uses_in_its_module():
    tree = ast.parse(
        "from os import sep, path as p\n"
        "A = B = 1\n"
        "def f(x: C):\n    return p.join(x, A)\n"
        "class C:\n    def g(self):\n        return h()\n"
        "def h():\n    return sep\n"
        "def unused():\n    return B\n"
    )
    used = [ast.unparse(statement) for statement in used_statements(tree, ("f",))]
    assert [text.splitlines()[0] for text in used] == [
        "from os import path as p",
        "from os import sep",
        "A = B = 1",
        "def f(x: C):",
        "class C:",
        "def h():",
    ]


def test_a_statement_that_changes_a_used_name_is_included():
    tree = ast.parse("TABLE = {}\nTABLE['a'] = 3\nOTHER = {}\nOTHER['b'] = 1\ndef f(): TABLE\n")
    used = [ast.unparse(statement) for statement in used_statements(tree, ("f",))]
    assert used[:2] == ["TABLE = {}", "TABLE['a'] = 3"] and len(used) == 3


def test_the_report_depends_on_every_byte_of_the_package(package):
    before = module.package_hash()
    (package / "store/scan.py").write_text("SCAN = 1  # edited\n")
    module.package_hash.cache_clear()
    assert module.package_hash() != before
    module.package_hash.cache_clear()


@pytest.fixture
def own_package(tmp_path, monkeypatch):
    """A package of a user, with an experiment that uses a helper module and our evaluation."""
    folder = tmp_path / "own_lab"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "helpers.py").write_text("def scale(x):\n    return 2 * x\ndef draw():\n    pass\n")
    (folder / "clock.py").write_text(
        "import functools\n"
        "def timed(function):\n"
        "    @functools.wraps(function)\n"
        "    def call(*arguments):\n"
        "        return function(*arguments)\n"
        "    return call\n"
    )
    (folder / "constants.py").write_text("GAIN = 2\n")
    (folder / "experiment.py").write_text(
        "from own_lab.clock import timed\n"
        "import own_lab.constants as constants\n"
        "from own_lab.helpers import scale, draw\n"
        "from .helpers import draw as again\n"
        "import numpy as np\n"
        "@timed\n"
        "def measure(inputs, settings, model):\n"
        "    from ajgdata.evaluate.metrics import wrapped\n"
        "    from ajgdata.store.labels import take_rows\n"
        "    return constants.GAIN * np.sum(scale(wrapped(take_rows(inputs), None)))\n"
        "def figure():\n"
        "    return again(draw())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield folder
    for name in [name for name in sys.modules if name.startswith("own_lab")]:
        del sys.modules[name]


def test_the_measuring_half_of_an_own_experiment_includes_its_helpers(own_package):
    file = own_package / "experiment.py"
    sources = {source.place: source.names for source in used_sources(file, "measure")}
    assert sources["own_lab/experiment.py"] == ("measure",)
    assert sources["own_lab/clock.py"] == ("timed",)
    assert sources["own_lab/constants.py"] == ()
    assert sources["own_lab/helpers.py"] == ("scale",)
    assert sources["evaluate/metrics.py"] == ()
    assert sources["store/labels.py"] == ("take_rows",)
    assert not any("numpy" in place for place in sources)


def test_a_source_without_a_definition_counts_as_a_whole(tmp_path):
    file = tmp_path / "a.py"
    file.write_text("measure = lambda: 1\nother = 2\n")
    assert module._source(file, {"<lambda>"}) == CodeSource(file)
    assert module._source(file, {"measure"}) == CodeSource(file, ("measure",))


def test_an_own_model_includes_the_modules_that_it_imports_from_its_package(
    own_package, monkeypatch
):
    (own_package / "models.py").write_text("from own_lab.helpers import scale\nimport numpy\n")
    point = EntryPoint("own", "own_lab.models:make", "ajgdata.models")
    files = module._own_files([point])
    assert [file.name for file in files] == ["helpers.py", "models.py"]
    assert {file.parent for file in files} == {own_package}
