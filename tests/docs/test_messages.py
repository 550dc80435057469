"""Messages of errors: where, what is wrong, what to do, in plain words."""

import ast
import re
from pathlib import Path

from test_words import AVOID

from ajgdata.types import DataError

PACKAGE = Path(__file__).resolve().parents[2] / "ajgdata"
ERRORS = {"DataError", "AudioError", "CardError", "RobotError", "TakeError", "NotPossibleError"}
#: A fix begins with a verb, never with these.
NO_VERB = re.compile(r"(there|it|its|these|they|declared|needs|the|a|an|no|not)\b")


def text(node: ast.expr) -> str:
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in parts)


def test_messages_have_three_parts_and_plain_words():
    assert str(DataError("a.wav", "is empty", "record again")) == "a.wav: is empty. Record again."
    problems = []
    fixes = []
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ERRORS:
                problems += map(text, node.args)
                fixes += map(text, node.args[2:][-1:])
            elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "fix":
                fixes.append(text(node.value))
    assert len(fixes) > 200
    assert [t for t in problems + fixes if AVOID.search(t) or t.endswith((".", ";", " "))] == []
    assert [t for t in fixes if NO_VERB.match(t)] == []
