"""Render a room in Blender (Cycles on the CPU) through its own perspective camera and lights.

python blender_render.py ROOM.usda PICTURE.png [--size 512] [--samples 48] [--camera perspective]

A picture called .npy is its linear radiance, (height, width, 3) float32.
"""

import argparse
import sys
import time

import bpy
import numpy as np

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("room")
parser.add_argument("picture")
parser.add_argument("--size", type=int, default=512)
parser.add_argument("--samples", type=int, default=48)
parser.add_argument("--camera", default="perspective", help="part of the camera's name")
arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else None)

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.world = bpy.data.worlds.new("World")  # as in Blender's own new files; it receives the dome light
bpy.ops.wm.usd_import(filepath=arguments.room, import_guide=False, import_proxy=False)
cameras = [thing for thing in bpy.data.objects if thing.type == "CAMERA"]
wanted = [camera for camera in cameras if arguments.camera.lower() in camera.name.lower()]
if not wanted:
    sys.exit(f"{arguments.room}: no camera called {arguments.camera!r}, found {[camera.name for camera in cameras]}")
scene = bpy.context.scene
scene.camera = wanted[0]
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = arguments.samples
scene.cycles.use_denoising = True
scene.cycles.max_bounces = 6
scene.view_settings.view_transform = "Standard"  # the looks' own colours; AgX greys them
film = wanted[0].data
scene.render.resolution_x = arguments.size
scene.render.resolution_y = round(arguments.size * film.sensor_height / film.sensor_width)
scene.render.resolution_percentage = 100
linear = arguments.picture.endswith(".npy")
scene.render.image_settings.file_format = "OPEN_EXR" if linear else "PNG"
scene.render.image_settings.color_depth = "32" if linear else "8"
scene.render.filepath = arguments.picture.replace(".npy", ".exr")
start = time.perf_counter()
bpy.ops.render.render(write_still=True)
if linear:
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], np.float32).reshape(*tuple(image.size)[::-1], -1)
    np.save(arguments.picture, pixels[::-1, :, :3])
lights = [f"{light.name} {light.data.energy:.0f} W" for light in bpy.data.objects if light.type == "LIGHT"]
print(f"{arguments.picture}: {time.perf_counter() - start:.1f} s, lights {lights}")
