"""Irradiance at places of a scene by Mitsuba 3, for `mesolux bench pareto`.

    python mitsuba_irradiance.py scene.obj job.json

job.json holds materials (name, kd, ke), points (position, intensity), places, normals, paths and limit. For each number of
paths, one line of JSON on stdout: {"paths", "seconds", "irradiance": [[r, g, b], ...]}; it stops when the next one would
probably take more than limit seconds. Reading the scene and compiling the kernels do not count. The last line of stderr
says why where it cannot run. LLVM mode needs a libLLVM of version 16 or newer (DRJIT_LIBLLVM_PATH names one).
"""

import json
import math
import sys
import time

try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
except ImportError as error:
    sys.exit(f"Mitsuba 3 is not installed: {error}")

try:
    mi.set_variant("llvm_ad_rgb")
    dr.eval(mi.Float(1) + 1)
except Exception as error:  # Dr.Jit has no class of its own for this
    sys.exit("Mitsuba 3 cannot use LLVM: " + str(error).splitlines()[0])

# Paths that are in flight at a time: about 1 GiB.
LANES = 1 << 20


def read_obj(path):
    """Vertices [V, 3] and triangles of each material {name: [T, 3]}."""
    vertices, faces, material = [], {}, None
    with open(path) as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(w) for w in words[1:4]])
            elif words[0] == "usemtl":
                material = line.split(None, 1)[1].strip()
            elif words[0] == "f":
                faces.setdefault(material, []).append([int(w.split("/")[0]) - 1 for w in words[1:4]])
    return np.array(vertices), {name: np.array(f) for name, f in faces.items()}


def scene_of(obj, job):
    vertices, faces = read_obj(obj)
    entries = {"type": "scene"}
    for i, material in enumerate(job["materials"]):
        triangles = faces.get(material["name"])
        if triangles is None:
            continue
        properties = mi.Properties()
        properties["face_normals"] = True
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": material["kd"]}}
        properties["bsdf"] = mi.load_dict(bsdf)
        if any(material["ke"]):
            light = {"type": "area", "radiance": {"type": "rgb", "value": material["ke"]}}
            properties["emitter"] = mi.load_dict(light)
        mesh = mi.Mesh(f"mesh{i}", 3 * len(triangles), len(triangles), props=properties)
        params = mi.traverse(mesh)
        params["vertex_positions"] = np.ravel(vertices[triangles.ravel()]).astype(np.float32)
        params["faces"] = np.arange(3 * len(triangles), dtype=np.uint32)
        params.update()
        entries[f"mesh{i}"] = mesh
    for i, point in enumerate(job["points"]):
        entries[f"point{i}"] = {
            "type": "point",
            "position": point["position"],
            "intensity": {"type": "rgb", "value": point["intensity"]},
        }
    return mi.load_dict(entries)


def irradiance(scene, integrator, places, normals, paths, seed):
    """Sum over the paths of each place, [place, 3]: emitters sampled and met, by the balance heuristic, and what is reflected."""
    count = places.shape[0]
    index = dr.arange(mi.UInt32, count * paths) // paths
    si = dr.zeros(mi.SurfaceInteraction3f, count * paths)
    si.p = dr.gather(mi.Point3f, mi.Point3f(places.T), index)
    si.n = dr.gather(mi.Normal3f, mi.Normal3f(normals.T), index)
    si.sh_frame = mi.Frame3f(si.n)
    si.t = 0.0
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count * paths)

    ds, weight = scene.sample_emitter_direction(si, sampler.next_2d(), True)
    cosine = dr.maximum(dr.dot(si.n, ds.d), 0)
    met = dr.select(ds.delta, 0, cosine / math.pi)
    found = weight * cosine * dr.select(ds.pdf > 0, ds.pdf / (ds.pdf + met), 0)

    direction = si.sh_frame.to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
    ray = si.spawn_ray(direction)
    hit = scene.ray_intersect(ray)
    emitter = hit.emitter(scene)
    emitted = emitter.eval(hit)
    density = scene.pdf_emitter_direction(si, mi.DirectionSample3f(scene, hit, si), emitter != None)
    met = dr.maximum(dr.dot(si.n, direction), 0) / math.pi
    # A grazing direction has no density at all where it meets no emitter.
    found += emitted * math.pi * dr.select(met > 0, met / (met + density), 0)
    seen, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(ray))
    found += math.pi * (seen - emitted)

    sums = [dr.block_sum(c, paths) for c in (found.x, found.y, found.z)]
    dr.eval(*sums)
    dr.sync_thread()
    return np.array([np.array(s) for s in sums]).T.astype(np.float64)


def main():
    obj, job = sys.argv[1], json.load(open(sys.argv[2]))
    scene = scene_of(obj, job)
    integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 5})
    places = np.array(job["places"], dtype=np.float32)
    normals = np.array(job["normals"], dtype=np.float32)
    irradiance(scene, integrator, places, normals, job["paths"][0], 0)
    seed = 1
    for paths in job["paths"]:
        most = max(1, LANES // len(places))
        # A power of two, so that the parts are equal and their kernels the same.
        part = min(paths, 1 << (most.bit_length() - 1))
        irradiance(scene, integrator, places, normals, part, 0)
        total = np.zeros_like(places, dtype=np.float64)
        start = time.perf_counter()
        for _ in range(paths // part):
            total += irradiance(scene, integrator, places, normals, part, seed)
            seed += 1
        seconds = time.perf_counter() - start
        answer = {"paths": paths, "seconds": seconds, "irradiance": (total / paths).tolist()}
        print(json.dumps(answer), flush=True)
        if 4 * seconds > job["limit"]:
            break


main()
