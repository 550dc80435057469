"""A robot's program that measures numbers of each grasp. Here, the arm is a constant pose.

In dataset.yaml: protocol: {robot: {command: [python, robot_numbers.py]}, …}
"""

import json
import sys

request = json.load(sys.stdin)  # e.g. {"step": "approach", "object": "mug", "force_n": 8.0, …}
if request["step"] == "approach":
    measured = {
        "force_n": 7.9,
        "x_m": 0.31,
        "joints_rad": [0.1, -1.2, 0.4],
        "pressure_kpa": 101.3,
    }
    print(json.dumps(measured))
