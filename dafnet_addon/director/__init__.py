"""From what a character is to do in a scene to its root path, hands and head: tasks planned one
after another, places to sit, work and write found on meshes, ways round furniture.

``planner.plan_tasks`` makes a plan of ``tasks``; what it is made of can be used alone:

>>> import numpy as np
>>> from dafnet_addon import Box
>>> from dafnet_addon.core.paths import Stop
>>> from dafnet_addon.director.seats import seat_of
>>> from dafnet_addon.director.walks import walk_to
>>> seat = Box(center=np.array([0.0, 0.0, 0.42]), half_size=np.array([0.22, 0.22, 0.03]))
>>> back = Box(center=np.array([0.0, 0.24, 0.7]), half_size=np.array([0.22, 0.02, 0.25]))
>>> found = seat_of([seat, back], towards=np.array([0.0, -2.0]), name="chair")
>>> round(found.height, 2)
0.45
>>> goal = Stop(tuple(found.position), found.yaw, seconds=2.0, seated=True)
>>> walked = walk_to([seat, back], Stop((0.0, 2.0), yaw=0.0), goal)
>>> bool(abs(walked.path.position[:, 0]).max() > 0.3)  # round the chair, to its front
True
"""
