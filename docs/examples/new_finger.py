"""Five fingers that each change a sound: how accurate is a model on a finger that is new to it?"""

import numpy as np

from ajgdata.evaluate.task_data import TaskData
from ajgdata.evaluate.transfer import Adaptation, group_scores, leave_groups_out

random = np.random.default_rng(0)
classes = np.tile(["none", "base", "tip"], 100)  # 300 grasps
fingers = np.repeat(["029", "030", "032", "035", "037"], 60)
grasps = np.array([f"grasp {number}" for number in range(300)])
patterns = {name: random.normal(10, 1, 40) for name in ("none", "base", "tip")}
features = np.array([patterns[name] + random.normal(0, 0.3, 40) for name in classes])
for finger in np.unique(fingers):  # each finger has its own gain and offset in each bin
    features[fingers == finger] *= random.uniform(0.2, 5, 40)
    features[fingers == finger] += random.uniform(0, 50, 40)

points = leave_groups_out(
    TaskData(features, classes, grasps, grasps),
    left_out=fingers,
    grasp=grasps,
    kind="classification",
    model="linear_plain",
    sizes=[4],
    adaptations=[Adaptation(False, 0), Adaptation(True, 0), Adaptation(False, 9)],
)
accuracy = {}
for name, adaptation in (
    ("unchanged", Adaptation(False, 0)),
    ("normalised per finger", Adaptation(True, 0)),
    ("aligned with 9 grasps", Adaptation(False, 9)),
):
    scores = group_scores([p for p in points if p.adaptation == adaptation], "classification")
    accuracy[name] = scores.value
    low, high = scores.interval
    print(f"{name}: accuracy {scores.value:.0%} ({low:.0%} to {high:.0%})")
