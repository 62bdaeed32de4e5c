"""Irradiance at places of a scene by Blender's Cycles, baked into a light map, for `mesolux bench pareto`.

    python cycles_irradiance.py scene.obj job.json

It needs the PyPI package bpy, 5.0 or newer. job.json holds materials (name, kd, ke), points (position, intensity),
triangles (three positions for each place), material (an index for each), paths and limit. `side` sets the light map's
side in texels, by default a power of two with about 3 texels for a triangle. scene.obj is not read: the triangles are
the scene. For each number of samples, two lines of JSON on stdout: {"method", "paths", "seconds", "irradiance":
[[r, g, b], ...]}, method "cycles" for the bake, "cycles-oidn" for the bake denoised. It stops when the next one would
probably take more than limit seconds. The last line of stderr says why where it cannot run.

Blender does not denoise what it bakes, so OpenImageDenoise runs in the compositor's denoise node: HDR, no albedo or
normal image, no prefilter. Seconds are those of the bake call, which builds the BVH and fills the margin, and of the
call that denoises, which also writes an uncompressed EXR file. Building the mesh and unwrapping it do not count.

A place has the value of the texel that holds the UV coordinates of its triangle's centroid. With `bilinear` true in
job.json, it has that of the four texels around it, as a renderer looks a light map up.
"""

import json
import math
import os
import sys
import tempfile
import time

try:
    import bpy
    import numpy as np
    from bpy_extras.mesh_utils import mesh_linked_uv_islands
except (ImportError, OSError) as error:
    sys.exit(f"Blender's bpy is not installed: {error}")

if bpy.app.version < (5, 0, 0):
    sys.exit(f"bpy {bpy.app.version_string} is older than 5.0, whose compositor this needs")

TEXELS_PER_TRIANGLE = 3
BOUNCES = 128
# Texels outside an island that show what adjoins it on the mesh (ADJACENT_FACES), so that the denoiser sees no border.
# EXTEND repeats the outermost texels with their noise, which leaves streaks.
MARGIN = 16
# Texels around an island that no other enters: the texel of a centroid at the edge is never another island's.
GAP = 2
# Greatest extent of an island, in sides of the square that its triangles deserve: a sliver must not fill the map.
LONGEST = 16
# A bake without colour divides by the reflectance; Cycles drops closures below 1e-5.
LEAST_KD = 1e-4


def emitter_and_diffuse(material, image):
    """Black behind; in front, a diffuse reflector that emits. The light map is the active node: bakes go there."""
    made = bpy.data.materials.new(material["name"])
    if made.node_tree is None:
        made.use_nodes = True
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = [max(k, LEAST_KD) for k in material["kd"]] + [1]
    diffuse.inputs["Roughness"].default_value = 0
    front = diffuse.outputs["BSDF"]
    strength = max(material["ke"])
    if strength > 0:
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = [k / strength for k in material["ke"]] + [1]
        emission.inputs["Strength"].default_value = strength
        both = nodes.new("ShaderNodeAddShader")
        link(front, both.inputs[0])
        link(emission.outputs["Emission"], both.inputs[1])
        front = both.outputs["Shader"]
        made.cycles.emission_sampling = "FRONT"
    sides = nodes.new("ShaderNodeMixShader")
    link(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], sides.inputs["Fac"])
    link(front, sides.inputs[1])
    link(sides.outputs["Shader"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    target = nodes.new("ShaderNodeTexImage")
    target.image = image
    nodes.active = target
    return made


def mesh_of(job, image):
    """The one object of the scene, selected and active."""
    corners = np.array(job["triangles"], dtype=np.float32).reshape(-1, 3)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    mesh = bpy.data.meshes.new("scene")
    mesh.from_pydata(vertices, [], index.reshape(-1, 3))
    mesh.shade_flat()
    for material in job["materials"]:
        mesh.materials.append(emitter_and_diffuse(material, image))
    mesh.polygons.foreach_set("material_index", np.array(job["material"], dtype=np.int32))
    mesh.update()
    thing = bpy.data.objects.new("scene", mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.select_set(True)
    bpy.context.view_layer.objects.active = thing
    return mesh


def add_points(points):
    for point in points:
        most = max(point["intensity"])
        if most <= 0:
            continue
        light = bpy.data.lights.new("point", "POINT")
        light.shadow_soft_size = 0
        light.use_soft_falloff = False
        # Watts over the whole sphere.
        light.energy = 4 * math.pi * most
        light.color = [i / most for i in point["intensity"]]
        thing = bpy.data.objects.new("point", light)
        thing.location = point["position"]
        bpy.context.scene.collection.objects.link(thing)


def coordinates(mesh):
    """UV of each corner, [triangle, 3, 2]."""
    uv = np.empty(6 * len(mesh.polygons), dtype=np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    return uv.reshape(-1, 3, 2)


def areas_of(uv):
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def unwrap(mesh, side):
    """Smart projection, whose flat walls stay whole, packed with as many texels for a triangle in each island."""
    mesh.uv_layers.new(name="map")
    bpy.context.scene.tool_settings.use_uv_select_sync = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=math.radians(66), island_margin=0, scale_to_bounds=False)
    bpy.ops.object.mode_set(mode="OBJECT")

    uv = coordinates(mesh)
    areas = areas_of(uv)
    islands = mesh_linked_uv_islands(mesh)
    for island in islands:
        extent = np.ptp(uv[island].reshape(-1, 2), axis=0).max()
        size = max(math.sqrt(areas[island].sum()), extent / LONGEST)
        if size > 0:
            uv[island] *= math.sqrt(len(island) / len(uv)) / size
    mesh.uv_layers.active.uv.foreach_set("vector", uv.ravel())

    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.uv.pack_islands(margin_method="FRACTION", margin=GAP / side, shape_method="CONCAVE")
    bpy.ops.object.mode_set(mode="OBJECT")
    return len(islands)


def owners(uv, side):
    """Texels whose centres each triangle holds, [triangle]."""
    texels = uv.astype(np.float64) * side - 0.5
    low = np.ceil(texels.min(axis=1)).astype(np.int64)
    size = np.maximum(np.floor(texels.max(axis=1)).astype(np.int64) - low + 1, 0)
    count = size.prod(axis=1)
    of = np.repeat(np.arange(len(uv)), count)
    turn = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    point = low[of] + np.stack([turn % size[of, 0], turn // size[of, 0]], axis=1)
    sides = []
    for k in range(3):
        a, b = texels[of, k], texels[of, (k + 1) % 3]
        sides.append((b[:, 0] - a[:, 0]) * (point[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (point[:, 0] - a[:, 0]))
    sides = np.array(sides)
    inside = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
    return np.bincount(of[inside], minlength=len(uv))


def set_up(scene):
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "AUTO"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.time_limit = 0
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.blur_glossy = 0
    cycles.use_fast_gi = False
    bake = scene.render.bake
    bake.use_selected_to_active = False
    bake.use_clear = True
    bake.margin = MARGIN
    bake.margin_type = "ADJACENT_FACES"


def bake(scene, samples, seed):
    """Seconds."""
    scene.cycles.samples = samples
    scene.cycles.seed = seed
    start = time.perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"})
    return time.perf_counter() - start


def denoiser_of(image, side, folder):
    """A scene that renders nothing: its compositor denoises the light map and writes it."""
    scene = bpy.data.scenes.new("denoise")
    tree = bpy.data.node_groups.new("denoise", "CompositorNodeTree")
    tree.interface.new_socket(name="Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    source, denoise = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("CompositorNodeDenoise")
    source.image = image
    denoise.inputs["HDR"].default_value = True
    denoise.inputs["Prefilter"].default_value = "None"
    denoise.inputs["Quality"].default_value = "High"
    tree.links.new(source.outputs["Image"], denoise.inputs["Image"])
    tree.links.new(denoise.outputs["Image"], tree.nodes.new("NodeGroupOutput").inputs["Image"])
    scene.compositing_node_group = tree
    render = scene.render
    render.use_compositing = True
    render.compositor_device = "CPU"
    render.compositor_precision = "FULL"
    render.resolution_x = render.resolution_y = side
    render.resolution_percentage = 100
    render.filepath = os.path.join(folder, "denoised.exr")
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    return scene


def denoise(scene):
    """Seconds."""
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True, scene=scene.name)
    return time.perf_counter() - start


def pixels_of(image):
    """RGB, [row from below, column, 3]."""
    side, channels = image.size[0], image.channels
    pixels = np.empty(side * side * channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(side, side, channels)[:, :, :3]


def look_up(pixels, uv, bilinear):
    """Values at UV coordinates [place, 2]: one texel's, or four texels' by their distance."""
    texels, last = uv.astype(np.float64) * len(pixels), len(pixels) - 1
    if not bilinear:
        column, row = np.clip(texels.astype(np.int64), 0, last).T
        return pixels[row, column].astype(np.float64)
    low = np.floor(texels - 0.5).astype(np.int64)
    part = texels - 0.5 - low
    found = np.zeros((len(uv), 3))
    for step in ((0, 0), (0, 1), (1, 0), (1, 1)):
        column, row = np.clip(low + step, 0, last).T
        weight = np.where(step, part, 1 - part).prod(axis=1)
        found += weight[:, None] * pixels[row, column]
    return found


def main():
    # Blender writes to stdout; the answers go to a copy of it.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    job = json.load(open(sys.argv[2]))
    count = len(job["triangles"])
    side = job.get("side") or 1 << round(math.log2(TEXELS_PER_TRIANGLE * count) / 2)

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    set_up(scene)
    image = bpy.data.images.new("light map", side, side, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    mesh = mesh_of(job, image)
    add_points(job["points"])
    islands = unwrap(mesh, side)
    if len(mesh.polygons) != count:
        sys.exit("Blender dropped triangles")

    uv = coordinates(mesh)
    centroids, bilinear = uv.mean(axis=1), job.get("bilinear", False)
    owned = owners(uv, side)
    print(
        f"{side} x {side} texels, {owned.sum() / side**2:.3f} of them in one of {islands} islands; "
        f"{np.mean(owned > 0):.3f} of {count} triangles own a texel",
        file=sys.stderr,
    )

    def answer(method, samples, seconds, pixels):
        found = math.pi * look_up(pixels, centroids, bilinear)
        line = {"method": method, "paths": samples, "seconds": seconds, "irradiance": found.tolist()}
        print(json.dumps(line), file=answers, flush=True)

    with tempfile.TemporaryDirectory() as folder:
        denoiser = denoiser_of(image, side, folder)
        # The first call loads the denoiser.
        denoise(denoiser)
        for seed, samples in enumerate(job["paths"], 1):
            seconds = bake(scene, samples, seed)
            answer("cycles", samples, seconds, pixels_of(image))
            seconds += denoise(denoiser)
            denoised = bpy.data.images.load(denoiser.render.filepath)
            denoised.colorspace_settings.name = "Non-Color"
            answer("cycles-oidn", samples, seconds, pixels_of(denoised))
            bpy.data.images.remove(denoised)
            if 4 * seconds > job["limit"]:
                break


main()
