"""All draws together: one row each, as a table of text and as arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.draws import DEFAULT
from ajgdata.draws.measuring import Draw
from ajgdata.draws.rows import BY_NAME, CHEAP, Row
from ajgdata.draws.sampling import place_of
from ajgdata.gripper.parameters import Parameter

Real = NDArray[np.float64]
#: Stands for the model of a row that needs none.
ENERGY = "energy"
#: What is kept of each reading, beside its value, and how its column ends.
ALSO = ("sd", "chance", "step")
HEAD = ("draw", "scenes", "refused")


def as_json(draw: Draw) -> dict[str, Any]:
    """Return a draw as JSON can hold it, but for what it cost: the same bytes each time."""
    content = asdict(draw)
    del content["seconds"]
    content["readings"] = [
        {key: _plain(value) for key, value in one.items() if key not in ("group", "loss")}
        for one in content["readings"]
    ]
    return content


def joined(draws: Iterable[Mapping[str, Any]]) -> tuple[list[str], list[dict[str, Any]]]:
    """Return header and rows of the table of draws, each as `as_json` made it, in their order.

    A column for each setting, and for each reading `row.model` and, of ALSO, `row.model.sd` …; what
    was not read is empty.
    """
    header, rows = list(HEAD), []
    for draw in draws:
        row = {"draw": draw["name"], "scenes": draw["scenes"], "refused": draw["refused"]}
        row |= draw["values"]
        for one in draw["readings"]:
            key = f"{one['row']}.{one['model'] or ENERGY}"
            row |= {key: one["value"], **{f"{key}.{also}": one[also] for also in ALSO}}
        rows.append(row)
        header += [key for key in row if key not in header]
    text = [{key: _text(row.get(key)) for key in header} for row in rows]
    return header, text


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return None if not math.isfinite(value) else float(f"{value:.9g}")
    return value


def _text(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Sweep:
    """A table of draws as arrays (n,), NaN where something is missing: `columns` by name; and the
    default gripper, by the same names, where the table has it."""

    names: tuple[str, ...]
    columns: Mapping[str, Real]
    default: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, str]]) -> Sweep:
        """Return the table whose rows are text. Raises ValueError for what is no number."""
        keys = [key for key in rows[0] if key != "draw"] if rows else []
        drawn = [row for row in rows if row["draw"] != DEFAULT]
        columns = {
            key: np.array([float(row[key]) if row[key] else np.nan for row in drawn])
            for key in keys
        }
        default = next((row for row in rows if row["draw"] == DEFAULT), {})
        known = {key: float(value) for key, value in default.items() if value and key in columns}
        return cls(tuple(row["draw"] for row in drawn), columns, known)

    def __len__(self) -> int:
        return len(self.names)

    def places(self, parameters: Sequence[Parameter]) -> Real:
        """Return where each draw lies in each parameter's range, (n, parameters) in [0, 1].

        Raises KeyError for a parameter that the table does not have.
        """
        columns = [
            [place_of(one, value) for value in self.columns[one.setting]] for one in parameters
        ]
        return np.array(columns).T.reshape(len(self), len(parameters))

    def model_of(self, row: Row) -> str:
        """Return the model that a row is told by: its own, else the cheap one of a quick sweep."""
        known = (row.model, CHEAP, ENERGY)
        return next((model for model in known if f"{row.name}.{model}" in self.columns), "")

    def read(self, row: Row, what: str = "") -> Real:
        """Return a row's values (n,), or another of what is kept of them ("sd", …)."""
        key = f"{row.name}.{self.model_of(row)}" + (f".{what}" if what else "")
        return self.columns.get(key, np.full(len(self), np.nan))

    def of_default(self, row: Row) -> float | None:
        """Return the default gripper's value of a row, read as the draws are."""
        return self.default.get(f"{row.name}.{self.model_of(row)}")

    def rows(self) -> list[Row]:
        """Return the rows of the paper that some draw has a value of."""
        return [row for row in BY_NAME.values() if np.isfinite(self.read(row)).any()]
