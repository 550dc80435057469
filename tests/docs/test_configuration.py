"""The configuration reference is current, every key says what it means, and something reads it."""

import ast
import subprocess
import sys
from pathlib import Path

import yaml

from tools import configuration

ROOT = Path(__file__).resolve().parents[2]


ROOTS = {**configuration.FILES, **configuration.MEASURED}
DECLARED = [model for _, model in configuration.nested(ROOTS)]
SCENES = [model for _, model in configuration.nested(configuration.SCENES)]
KEYS = [(model, key) for model in DECLARED for key in model.model_fields]
SETTINGS = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())["properties"]


def names_read(folder: Path) -> set[str]:
    """Attributes that are looked at, and names of the arguments that settings are handed on as."""
    names = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.arg):
                names.add(node.arg)
    return names


#: `driver` and `software` of a session are for people.
READ = names_read(ROOT / "ajgdata") | {"driver", "software"}


def test_the_page_is_what_its_maker_writes():
    assert configuration.page() == (ROOT / "docs/configuration.md").read_text(encoding="utf-8")


def test_every_key_of_a_declaration_says_what_it_means():
    said = {f"{m.__name__}.{key}": m.model_fields[key].description or "" for m, key in KEYS}
    assert [key for key, text in said.items() if len(text) < len("how")] == []


def test_every_key_is_read():
    keys = {f"{m.__name__}.{key}": key for m in [*DECLARED, *SCENES] for key in m.model_fields}
    unread = {name for name, key in keys.items() if key not in READ}
    assert unread <= {"Session.software", "Acquisition.level_dbfs"}  # provenance for people


def test_every_key_of_the_workflow_is_said_and_read():
    rules = "".join(
        p.read_text() for p in [ROOT / "workflow/Snakefile", *ROOT.glob("workflow/rules/*.smk")]
    )
    for key, schema in SETTINGS.items():
        assert schema["description"]
        assert f'config["{key}"]' in rules


def test_the_command_line_reference_is_current(tmp_path):
    page = tmp_path / "command-line.md"
    options = ["--name", "ajgdata", "--title", "Command line", "--output", str(page)]
    command = [sys.executable, "-m", "typer", "ajgdata.cli", "utils", "docs", *options]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    assert page.read_text() == (ROOT / "docs/command-line.md").read_text(encoding="utf-8")
