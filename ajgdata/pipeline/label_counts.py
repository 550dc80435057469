"""Numbers of recordings, objects, grasps and classes of a data set, for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from ajgdata.acquire.protocol import REFERENCE
from ajgdata.pipeline.label_issues import MAX_LISTED, Tables, is_value, missing_texts
from ajgdata.store.findings import is_rejected
from ajgdata.store.listing import listed
from ajgdata.types import Target, many


def label_counts(tables: Tables, targets: Mapping[str, Target]) -> dict[str, str]:
    """Return the numbers of recordings, objects and grasps, and of recordings per class.

    Empty-gripper references are not grasps and are counted separately.
    """
    all_rows = [(session, row) for session, table in tables.items() for row in table]
    rows = [(session, row) for session, row in all_rows if not row.get(REFERENCE)]
    used = [row for _, row in rows if not is_rejected(row)]
    grasps = Counter((session, row["grasp_id"]) for session, row in rows)
    sample_counts = []
    for samples, count in sorted(Counter(grasps.values()).items()):
        sample_counts.append(f"{samples} ({many(count, 'grasp')})")
    rejections = f" ({len(rows) - len(used)} rejected)" if len(used) < len(rows) else ""
    facts = {
        "recordings": f"{len(rows)}{rejections}",
        "objects": str(len({row["object"] for _, row in rows} - {""})),
        "grasps": str(len(grasps)),
        "samples per grasp": listed(sample_counts, MAX_LISTED),
    }
    references = len(all_rows) - len(rows)
    if references:
        facts["references"] = str(references)
    for name, target in targets.items():
        facts[f"recordings per {name}"] = _value_counts([row.get(name, "") for row in used], target)
    return facts


def _value_counts(texts: Sequence[str], target: Target) -> str:
    """Return the number of texts per class of a target, or of its numbers, and of missing ones."""
    cells = Counter(texts)
    missing = sum(cells.pop(text, 0) for text in missing_texts(target))
    suffix = f"; {missing} missing" if missing else ""
    if target.kind == "classification":
        values = [f"{text} {count}" for text, count in cells.most_common()]
        return listed(values, MAX_LISTED) + suffix
    words = {text: count for text, count in cells.items() if not is_value(text, target)}
    numbers = cells - Counter(words)
    if words:
        suffix += f"; {sum(words.values())} not a number"
    return f"{numbers.total()} numbers, {len(numbers)} distinct{suffix}"
