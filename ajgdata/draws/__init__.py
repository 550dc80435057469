"""Which gripper would have given the paper's figures: virtual grippers drawn from what is not known
of the real one, each measured by reduced versions of the paper's rows; and designs compared so."""

#: The gripper of the declarations, measured by the same reduced rows: what reducing them costs.
DEFAULT = "default"


def draw_names(count: int) -> list[str]:
    """Return the names of `count` draws: draw_000, draw_001, …"""
    return [f"draw_{number:03d}" for number in range(count)]
