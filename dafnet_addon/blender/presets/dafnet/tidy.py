import bpy

own = bpy.context.object.dafnet

own.temperature = 0.0
own.take_count = 1
own.plant_feet = 1.0
own.rest_on_seats = 1.0
own.reach_targets = 1.0
own.clear_furniture = 1.0
own.smooth = 0.3
