"""What tests share. Scenes, rigs and files are made by code.

``places``: the repository and the data beside it; ``stage``: a Blender scene with a character;
``panels``: a layout that notes what is drawn; ``humanoids``: rigs of seven conventions;
``motion_files``: writers of motion capture; ``datasets``: a small training set; ``limits`` and
``processes``: what an attempt may take, and what a process said; ``window``: a user with mouse and
keys.
"""
