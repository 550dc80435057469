"""What the Snakemake workflow catalogue asks for."""

import re
from pathlib import Path
from pkgutil import resolve_name

import yaml
from pydantic import validate_call

ROOT = Path(__file__).resolve().parents[2]


def test_every_key_of_the_configuration_is_explained_with_its_default():
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    defaults = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    explained = (ROOT / "config/README.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| `(\w+)` \|", explained, re.M)
    assert {key: yaml.safe_load(given) for key, given in rows} == defaults
    assert defaults == {key: value["default"] for key, value in schema["properties"].items()}


def test_every_rule_names_a_function_whose_arguments_can_be_validated():
    rules = "".join(file.read_text() for file in (ROOT / "workflow/rules").glob("*.smk"))
    names = re.findall(r'function="([^"]+)"', rules)
    assert len(names) == rules.count("script:")
    for name in names:
        validate_call(resolve_name(f"ajgdata.pipeline.{name}"))
