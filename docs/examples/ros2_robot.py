"""A ROS 2 arm as a robot: each step is one call, and what is sent is made by pure functions.

In dataset.yaml: protocol: {robot: {command: [python, ros2_robot.py]}, …}
"""

import json
import sys
import time

PRESS = "/gripper/press"  # control_msgs/action/GripperCommand of an impedance controller
PUMP = "/gripper/pump"  # std_srvs/srv/SetBool: true evacuates
LIFTED_M, LOW_M, LIFT_FORCE_N = 0.10, 0.0, 50.0
LIFT = (PRESS, {"position": LIFTED_M, "max_effort": LIFT_FORCE_N})
LET_GO = (PUMP, {"data": False})


def calls_of(step, force_n=5.0, bin=""):
    """Return name and fields of the calls that make a step, in order."""
    lower = (PRESS, {"position": LOW_M, "max_effort": force_n})  # until something resists
    return {
        "loosen": [LIFT, LET_GO],  # away from any object
        "approach": [lower],
        "jam": [(PUMP, {"data": True})],
        "lift": [LIFT],
        "release": [lower, LET_GO, LIFT],  # nothing falls
        "place": [(f"/bins/{bin}", {}), LET_GO],  # std_srvs/srv/Trigger
        "halt": [("/arm/stop", {})],  # std_srvs/srv/Trigger; the pump stays as it is: nothing falls
    }[step]


def force_of(answer):
    """Return the force (N) in the answer to `approach`; exit if nothing was touched."""
    if not answer["stalled"]:
        sys.exit(f"met nothing at {answer['position']} m; put the object there")
    return answer["effort"]


def make_step(call, step, **about):
    """Make a step by `call(name, fields)`, which returns the answer's fields; return the force (N)
    of `approach`. After `halt` a person takes what is held out of the jammed gripper."""
    make = lambda step, **fields: [call(*request) for request in calls_of(step, **fields)][-1]  # noqa: E731
    match step:
        case "approach" if not about["object"]:  # a reference: hang free
            return make("lift")["effort"]
        case "approach":
            return force_of(make("approach", force_n=about["force_n"]))
        case "hold":  # the controller does it
            time.sleep(about["seconds"])
        case "place":
            make("place", bin=about["bin"])
        case _:
            make(step)
    return None


def main():
    """Make the step on standard input; `lab.ros2.Node.call` sends with rclpy, and waits."""
    from lab.ros2 import Node

    with Node() as node:
        force_n = make_step(node.call, **json.load(sys.stdin))
    if force_n is not None:
        print(json.dumps({"force_n": force_n}))


if __name__ == "__main__":
    main()
