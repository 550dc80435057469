"""docs/parameters.md lists each physical setting once, with its default and a range around it."""

import math
import re
import typing
from pathlib import Path

import pytest
from pydantic import BaseModel

from ajgdata.gripper import Scene, SignalChain
from ajgdata.gripper.variation import Variation

PAGE = Path(__file__).resolve().parents[2] / "docs/parameters.md"
#: First words of the names of settings that are not part of a scene.
ROOTS: dict[str, type[BaseModel]] = {"signal": SignalChain, "variation": Variation}
#: Keys of Scene that are not physical settings: the object, the solver, and amounts that a
#: variation samples.
SAMPLED = {
    "grasp.placed_mm",
    "grasp.placed_deg",
    "grasp.temperature_k",
    "grasp.history",
    "grasp.nuisance.grain_force",
}
OTHER = {"object", "numerics", "assembly", "session", *SAMPLED}
ROWS = {
    row[0].strip("`"): row[1:]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if line.startswith("| `")
    for row in [[cell.strip() for cell in line.strip("|").split("|")]]
}


def numbers_of(model: BaseModel, before: str = "") -> dict[str, float | None]:
    """Defaults of the numbers of a model by path, without seeds."""
    numbers: dict[str, float | None] = {}
    for key, field in type(model).model_fields.items():
        path = f"{before}{key}"
        value = getattr(model, key)
        if path in OTHER or key.endswith("seed"):
            continue
        kinds = {field.annotation, *typing.get_args(field.annotation)}
        inner = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        if inner:
            numbers |= numbers_of(inner[0]() if value is None else value, f"{path}.")
        elif isinstance(value, tuple):
            numbers |= {f"{path}.{place}": item for place, item in enumerate(value)}
        elif "float" in str(field.annotation) or field.annotation is int:
            numbers[path] = value
    return numbers


DEFAULTS = numbers_of(Scene())
for name, root in ROOTS.items():
    DEFAULTS |= numbers_of(root(), f"{name}.")


def test_every_physical_setting_has_one_row():
    assert {"gripper.speaker_mm.1", "signal.motor.depth", "signal.resonances_q.0"} <= set(DEFAULTS)
    assert PAGE.read_text(encoding="utf-8").count("\n| `") == len(ROWS)
    assert set(ROWS) == set(DEFAULTS)


@pytest.mark.parametrize("name", ROWS)
def test_the_default_is_as_listed_and_in_the_middle_of_its_range(name):
    (written, text, _, evidence, source) = ROWS[name]
    value = DEFAULTS[name]
    assert written == ("none" if value is None else f"{value:g}")
    assert len(source) > 5
    if text == "known":
        assert evidence != "estimate", "an estimate has a range"
        return
    low, high = map(float, re.fullmatch(r"(\S+) to (\S+)", text).groups())
    assert low <= high
    if value is not None:
        assert low * (1 - 1e-2) <= value <= high * (1 + 1e-2)  # ranges have three digits
        if evidence == "estimate" and "default:" not in source:
            is_log = low > 0 and high > 3 * low * (1 + 1e-9)
            middle = math.sqrt(low * high) if is_log else (low + high) / 2
            assert value == pytest.approx(middle, rel=0.1)
