#!/usr/bin/env python3
"""Bakes the light map of a scene with Blender's Cycles, and compares ours to it.

    mesolux export SCENE --glb room.glb --light-map light.exr
    python3 tests/peers/cycles_light_map.py room.glb light.exr [SAMPLES]

Needs a Python that Blender's package `bpy` is for, and one page. Cycles bakes direct and indirect
light twice, with different seeds, up to 64 reflections, without a denoiser: what the two differ by
is its noise, which falls out of the products of what ours differs by from each. Printed are the
seconds of each bake, the noise of one, and our bias and rms; all over the mean, of all texels that
Cycles gives light, and of those with such texels on all four sides.
"""

import sys
import time

import bpy
import numpy as np


def load(path):
    """The meshes of a scene as one object. Its surfaces are Lambert's, as ours: those of glTF
    reflect 4 % as glass does."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    bpy.ops.object.select_all(action="DESELECT")
    meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
    for mesh in meshes:
        mesh.select_set(True)
    bpy.context.view_layer.objects.active = meshes[0]
    if len(meshes) > 1:
        bpy.ops.object.join()
    mesh = bpy.context.view_layer.objects.active
    mesh.data.uv_layers.active_index = 1
    for slot in mesh.material_slots:
        for node in slot.material.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Specular IOR Level"].default_value = 0.0
    return mesh


def pixels(image):
    """`[row][column][RGB]` from the top."""
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)[::-1, :, :3].astype(np.float64)


def bake(mesh, size, samples, seed):
    """Irradiance, W/m², `[row][column][RGB]`, and the seconds it took."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples, cycles.seed = samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    image = bpy.data.images.new(f"light {seed}", *size, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    for slot in mesh.material_slots:
        nodes = slot.material.node_tree.nodes
        node = nodes.new("ShaderNodeTexImage")
        node.image = image
        nodes.active = node
    start = time.time()
    bpy.ops.object.bake(
        type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True
    )
    return np.pi * pixels(image), time.time() - start


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    mesh = load(sys.argv[1])
    ours = bpy.data.images.load(sys.argv[2])
    ours.colorspace_settings.name = "Non-Color"
    samples = int(sys.argv[3]) if len(sys.argv) > 3 else 32
    (a, first), (b, second) = [bake(mesh, ours.size, samples, seed) for seed in (1, 2)]
    light = pixels(ours)
    print(f"Cycles, {samples} samples: {first:.1f} and {second:.1f} s")
    lit = (a.sum(2) > 0) & (b.sum(2) > 0)
    beside = [np.roll(lit, step, axis) for step in (1, -1) for axis in (0, 1)]
    for name, of in [("all", lit), ("within", lit & np.all(beside, 0))]:
        mean = (a + b)[of].mean() / 2
        noise = np.sqrt(((a - b)[of] ** 2).mean() / 2) / mean
        bias = light[of].mean() / mean - 1
        square = ((a - light) * (b - light))[of].mean()
        print(
            f"{name}, {of.sum()} texels: noise of Cycles {noise:.2%}, "
            f"ours bias {bias:+.2%}, rms {np.sqrt(max(square, 0)) / mean:.2%}"
        )


main()
