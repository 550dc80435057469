"""Plans of sorting: what is refused before anything moves."""

import pytest
from pydantic import ValidationError
from sorting_lab import PLAN, plan

from ajgdata.types.protocol import SortPlan


def test_the_defaults_are_the_paper_s():
    defaults = SortPlan.model_validate({k: v for k, v in PLAN.items() if k not in ("references",)})
    assert (defaults.threshold, defaults.below, defaults.force_n) == (0.6, "stop", 8.0)
    assert defaults.references.every == 10


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"below": "reject"}, "below is reject: name the reject_bin"),
        ({"unknown": "reject"}, "unknown is reject: name the reject_bin"),
        ({"order": "random"}, "needs objects"),
        ({"source": "virtual"}, "needs objects"),
        ({"card": {}}, "card.device is missing"),
    ],
)
def test_a_plan_that_cannot_be_followed_says_why(changes, said):
    with pytest.raises(ValidationError, match=said):
        plan(**changes)
