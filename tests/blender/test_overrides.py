"""Characters of a library: overrides get takes of their own, which the file keeps."""

from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job

from kit.stage import Stage, bone_heads


def test_a_library_override_gets_takes_of_its_own_that_the_file_keeps(
    blender: ModuleType, tmp_path: Path
) -> None:
    stage = Stage(frames=(1, 12), furnished=False)
    stage.walk((1, 0.0), (12, 0.4))
    library, file = tmp_path / "library.blend", tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(library))

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.collections = ["Ann"]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.frame_end = 12
    linked = wanted.collections[0]
    linked.override_hierarchy_create(scene, layer, do_fully_editable=True)
    (ann,) = (each for each in scene.objects if each.type == "ARMATURE")
    assert ann.override_library and ann.dafnet.root.override_library
    result = job.run(bpy.context, settings_of(ann, scene))
    bpy.ops.wm.save_as_mainfile(filepath=str(file))

    bpy.ops.wm.open_mainfile(filepath=str(file))
    (ann,) = (each for each in bpy.context.scene.objects if each.type == "ARMATURE")
    action = ann.animation_data.action
    assert action.library is None and [row.action for row in ann.dafnet.takes] == [action]
    heads = bone_heads(ann, 12)
    np.testing.assert_allclose(heads, result.take.joints[-1], atol=1e-4)
