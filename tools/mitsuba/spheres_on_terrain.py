"""Frames of scenes/spheres_on_terrain by Mitsuba 3, as exr files; `pan.py` starts this as a process of its own.

The argument is a JSON object: `scene` (the scene file), `frames` (numbers), `move` (frames of the whole move), `size`,
`samples`, `seed` and `folder`. Printed are CPU seconds of loading (Mitsuba itself, meshes, tree) and of rendering.
"""

import json
import os
import sys
import time
import tomllib

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

import scenes

# Most samples of one pass, which fit in memory.
PASS = 64
# Weight of the sky, beside 1 for the lamp, in the choice of a light: of 1, 0.5, 0.25 and 0.1 the least error at equal time.
SKY_WEIGHT = 0.25


class Whitted(mi.SamplingIntegrator):
    """Direct light of diffuse surfaces, seen by mirrors and glass; each point samples one light, picked by chance.

    Glass reflects or refracts by chance. Whatever is in the way blocks light, glass too. A sample of each light takes more
    time at equal error.
    """

    def __init__(self, properties):
        super().__init__(properties)
        self.bounces = properties.get("bounces", 8)

    @dr.syntax
    def sample(self, scene, sampler, ray, medium=None, active=True):
        context = mi.BSDFContext()
        ray, active = mi.Ray3f(ray), mi.Bool(active)
        radiance, throughput, left = mi.Spectrum(0), mi.Spectrum(1), mi.UInt32(self.bounces)
        while active:
            hit = scene.ray_intersect(ray, active)
            radiance += throughput * hit.emitter(scene, active).eval(hit, active)
            active &= hit.is_valid()
            bsdf = hit.bsdf(ray)
            diffuse = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            light, weight = scene.sample_emitter_direction(hit, sampler.next_2d(diffuse), True, diffuse)
            radiance += throughput * weight * bsdf.eval(context, hit, hit.to_local(light.d), diffuse & (light.pdf > 0))
            active &= ~diffuse & (left > 0)
            way, share = bsdf.sample(context, hit, sampler.next_1d(active), sampler.next_2d(active), active)
            active &= dr.max(share) > 0
            ray = hit.spawn_ray(hit.to_world(way.wo))
            throughput *= share
            left -= 1
        return radiance, mi.Bool(True), []


mi.register_integrator("whitted", Whitted)


def terrain(vertices, size):
    """Positions and triangles, as src/import/generators.rs makes them; the shading is flat."""
    x, z = np.meshgrid(*2 * [np.linspace(-size / 2, size / 2, vertices)])
    y = 0.6 * np.sin(0.55 * x + 0.3) * np.cos(0.45 * z - 0.2) + 0.25 * np.sin(1.7 * x + 0.9 * z + 1)
    y += 0.08 * np.sin(4.3 * x - 3.1 * z + 0.5) + 0.03 * np.sin(11 * x + 7 * z) * np.sin(9 * z - 5 * x)
    y += 0.008 * np.sin(37 * x + 5 * z) * np.sin(41 * z - 3 * x)
    at = np.arange(vertices**2).reshape(vertices, vertices)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
    return np.stack([x, y, z], -1).reshape(-1, 3), np.concatenate([np.stack(t, -1) for t in ((a, c, b), (b, c, d))]), None


def uv_sphere(centre, radius, meridians, bands):
    """Positions, triangles and normals; each pole is as many vertices as there are meridians."""
    phi, theta = np.meshgrid(2 * np.pi * np.arange(meridians) / meridians, np.pi * np.arange(bands + 1) / bands)
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    at = np.arange(len(normals)).reshape(bands + 1, meridians)
    beside = np.roll(at, -1, axis=1)
    upper = np.stack([at[1:-1], beside[1:-1], at[2:]], -1)
    lower = np.stack([beside[:-2], beside[1:-1], at[1:-1]], -1)
    return normals * radius + centre, np.concatenate([upper.reshape(-1, 3), lower.reshape(-1, 3)]), normals


def bsdf(material):
    if "diffuse" in material:
        return scenes.matte(material["diffuse"])
    if "mirror" in material:
        return {"type": "conductor", "material": "none", "specular_reflectance": scenes.rgb(material["mirror"])}
    return {"type": "dielectric", "int_ior": material["glass"]["ior"], "ext_ior": 1.0}


def mesh(described, materials):
    make, keys = (terrain, described["terrain"]) if "terrain" in described else (uv_sphere, described["uv_sphere"])
    positions, triangles, normals = make(**keys)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf(materials[described["material"]]))
    made = mi.Mesh(described["name"], len(positions), len(triangles), properties, normals is not None)
    parts = mi.traverse(made)
    # tweenray rounds generated coordinates to six decimals.
    parts["vertex_positions"] = np.round(positions, 6).astype(np.float32).ravel()
    parts["faces"] = triangles.astype(np.uint32).ravel()
    if normals is not None:
        parts["vertex_normals"] = normals.astype(np.float32).ravel()
    parts.update()
    return made


def load(scene):
    built = {"type": "scene", "integrator": {"type": "whitted", "bounces": scene["settings"]["bounces"]}}
    built["sky"] = {"type": "constant", "sampling_weight": SKY_WEIGHT, "radiance": scenes.rgb(scene["sky"]["radiance"])}
    quad = scene["light"][0]["quad"]
    built["lamp"] = scenes.lamp(quad["centre"], 0.5 * quad["size"][0], quad["radiance"])
    built.update({f"mesh{i}": mesh(described, scene["material"]) for i, described in enumerate(scene["mesh"])})
    return mi.load_dict(built)


def sensor(camera, progress, size, samples):
    pan = camera["pan"]
    eye = [a + progress * (b - a) for a, b in zip(pan["from"], pan["to"])]
    film = {"type": "hdrfilm", "width": size[0], "height": size[1], "pixel_format": "rgb", "rfilter": {"type": "box"}}
    look = mi.ScalarTransform4f().look_at(origin=eye, target=pan["target"], up=[0, 1, 0])
    sampler = {"type": "multijitter", "sample_count": samples}
    view = {"fov": camera["fov"], "fov_axis": "y", "to_world": look}
    return mi.load_dict({"type": "perspective", **view, "film": film, "sampler": sampler})


def main():
    job = json.loads(sys.argv[1])
    with open(job["scene"], "rb") as file:
        scene = tomllib.load(file)
    world = load(scene)
    loaded = time.process_time()
    passes, each = max(1, job["samples"] // PASS), min(job["samples"], PASS)
    for number in job["frames"]:
        view = sensor(scene["camera"], (number - 1) / (job["move"] - 1), job["size"], each)
        seeds = ((job["seed"] * 1000 + number) * 1000 + k for k in range(passes))
        picture = sum(np.array(mi.render(world, sensor=view, spp=each, seed=seed)) for seed in seeds) / passes
        mi.Bitmap(picture.astype(np.float32)).write(os.path.join(job["folder"], f"frame_{number:04}.exr"))
    print(json.dumps({"load": loaded, "render": time.process_time() - loaded}))


if __name__ == "__main__":
    main()
