"""A ROS 2 arm as a robot: each step is one call, and what is sent is made by pure functions.

In ROBOTS of ajgdata/types/registry.py: "ros2": "lab:open_ros2", for your package `lab`;
then, in dataset.yaml: protocol: {robot: ros2, …}
"""

import time
from contextlib import contextmanager

from ajgdata.acquire.robot import RobotError

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
    """Return the force (N) in the answer to `approach`; RobotError if nothing was touched."""
    if not answer["stalled"]:
        problem = f"met nothing at {answer['position']} m"
        raise RobotError("approach", problem, "put the object there")
    return answer["effort"]


class Ros2Robot:
    """Robot (see acquire.robot) by `call(name, fields)`, which returns the answer's fields."""

    def __init__(self, call):
        self._call = call

    def _make(self, step, **about):
        return [self._call(*call) for call in calls_of(step, **about)][-1]

    def move(self, step, **about):
        """Make a step; after `halt` a person takes what is held out of the jammed gripper."""
        match step:
            case "approach" if not about["object"]:  # a reference: hang free
                return self._make("lift")["effort"]
            case "approach":
                return force_of(self._make("approach", force_n=about["force_n"]))
            case "hold":  # the controller does it
                time.sleep(about["seconds"])
            case "place":
                self._make("place", bin=about["bin"])
            case _:
                self._make(step)
        return None


@contextmanager
def open_ros2(settings, confirm):
    """Yield the robot; `lab.ros2.Node.call` sends with rclpy, waits, and raises RobotError."""
    from lab.ros2 import Node

    with Node(**settings) as node:
        yield Ros2Robot(node.call)
