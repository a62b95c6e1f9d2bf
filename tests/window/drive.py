import sys
from pathlib import Path
import bpy
sys.path.insert(0, str(Path(__file__).parent))
from driver import Driver, Waits, play
PICTURES = Path(sys.argv[sys.argv.index("--") + 1])
def everything() -> Waits:
    user = Driver(PICTURES)
    yield from user.press("ESC")
    with user.override():
        bpy.ops.object.select_all(action="SELECT"); bpy.ops.object.delete()
        bpy.ops.dafnet.add_character(name="Ann")
    ann = bpy.data.objects["Ann"]
    bpy.context.scene.frame_end = 60
    for frame, y in ((1, 0.0), (60, 1.8)):
        ann.dafnet.root.location.y = y
        ann.dafnet.root.keyframe_insert("location", frame=frame)
    ann.dafnet.take_count = 4
    ann.dafnet.mode = "EE"
    yield from user.sidebar("DAFNet")
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(lambda: len(ann.dafnet.takes) == 4, "takes")
    yield 0.5
    yield from user.picture("takes")
play(everything)
