"""Compare designs of a gripper by reduced versions of the paper's rows, recorded in memory."""
