"""Each physical setting has a row that says what is known of it, and its default agrees."""

import typing

import pytest
from pydantic import BaseModel

from ajgdata.gripper import Scene
from tools import parameters
from tools.parameter_ranges import PARAMETERS, ROOTS, Parameter, default_of

#: Keys of Scene that are not physical settings: what is grasped, how it is solved, and what a
#: variation draws by amounts of its own.
DRAWN = {"grasp.placed_mm", "grasp.placed_deg", "grasp.history", "grasp.nuisance.grain_force"}
OTHER = {"object", "numerics", "assembly", "session", *DRAWN}
#: What a middle may be rounded by to be a default.
ROUNDED = 0.1


def _numbers(model: type[BaseModel], before: str) -> set[str]:
    """Paths of the numbers of a model, but seeds."""
    found = set()
    for key, field in model.model_fields.items():
        path = f"{before}{key}"
        if path in OTHER or key.endswith("seed"):
            continue
        kinds = {field.annotation, *typing.get_args(field.annotation)}
        models = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        if models:
            found |= set().union(*(_numbers(one, f"{path}.") for one in models))
        elif isinstance(default := default_of(path), tuple):
            found |= {f"{path}.{place}" for place in range(len(default))}
        elif "float" in str(field.annotation) or field.annotation is int:
            found.add(path)
    return found


NUMBERS = _numbers(Scene, "").union(*(_numbers(root, f"{name}.") for name, root in ROOTS.items()))


def test_every_physical_setting_has_one_row():
    assert {"gripper.speaker_mm.1", "signal.motor.depth", "signal.resonances_q.0"} <= NUMBERS
    assert sorted(one.setting for one in PARAMETERS) == sorted(NUMBERS)


@pytest.mark.parametrize("row", PARAMETERS, ids=lambda row: row.setting)
def test_the_default_agrees_with_its_row(row: Parameter):
    assert row.low <= row.high
    assert len(row.source) > 5
    value = default_of(row.setting)
    if value is not None:
        assert row.low <= value <= row.high
    assert (row.scale == "log") == (row.low > 0 and row.high > 3 * row.low * (1 + 1e-9))
    if row.evidence == "estimate":
        assert row.low < row.high, "an estimate has a range"
        if "default:" not in row.source:
            assert value == pytest.approx(row.middle, rel=ROUNDED)


def test_the_page_is_what_its_maker_writes():
    written = parameters.PAGE.read_text(encoding="utf-8")
    assert parameters.page() == written
    assert written.count("\n| `") == len(PARAMETERS)
