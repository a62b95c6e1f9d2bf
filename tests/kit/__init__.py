"""What tests share. Scenes, rigs and files are made by code.

``places``: the repository and the data beside it; ``stage`` and ``rig_stage``: a Blender scene with
a character, and with a rig beside it; ``panels``: what a panel draws; ``humanoids``: rigs of seven
conventions; ``motion_files``: writers of motion capture; ``datasets``: a small training set;
``limits``: what an attempt may take; ``messages``: what was said; ``rooms``: furniture of boxes;
``window``: a user with mouse and keys.
"""
