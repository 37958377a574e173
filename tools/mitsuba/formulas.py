"""tweenray's formula for layered surfaces (docs/decisions/024 and 032), written anew as a BSDF of Mitsuba's.

Mitsuba's own `principled` is another model: its diffuse part grows towards grazing angles, its coat has another distribution of
microfacets, and light that meets a second microfacet is lost. With this BSDF what is compared is all else: geometry, sampling,
lamps, environments, and the formula as it is written in Rust.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

# Nodes of a table by the square root of the cosine, and samples along each axis for a node.
NODES, SAMPLES = 256, 96
# A smoother surface counts as one of this roughness.
LEAST_ROUGHNESS = 3e-3


def schlick(cos):
    x = 1.0 - cos
    return x * x * x * x * x


def smith(alpha, cos):
    """Hidden over visible area of the microfacets along a direction of this cosine."""
    return 0.5 * ((1.0 + alpha * alpha * (1.0 - cos * cos) / (cos * cos)) ** 0.5 - 1.0)


def albedos(roughness):
    """By cosine: what a rough surface reflects once, with white microfacets and with those that Schlick's factor says.

    By samples of the microfacets that are seen (Heitz, 2018), in numpy.
    """
    alpha = max(roughness, LEAST_ROUGHNESS) ** 2
    u, v = np.meshgrid(*(2 * [(np.arange(SAMPLES) + 0.5) / SAMPLES]))
    rows = []
    for cos in np.maximum(np.linspace(0.0, 1.0, NODES), 1e-3) ** 2:
        viewer = np.array([np.sqrt(1.0 - cos * cos), 0.0, cos])
        seen = viewer * [alpha, alpha, 1.0]
        seen /= np.linalg.norm(seen)
        radius, phi = np.sqrt(u), 2.0 * np.pi * v
        a, b = radius * np.cos(phi), radius * np.sin(phi)
        share = 0.5 * (1.0 + seen[2])
        b = (1.0 - share) * np.sqrt(1.0 - a * a) + share * b
        s = np.array([0.0, 1.0, 0.0])
        t = np.cross(seen, s)
        m = a[..., None] * s + b[..., None] * t + np.sqrt(np.maximum(0.0, 1.0 - a * a - b * b))[..., None] * seen
        m *= [alpha, alpha, 1.0]
        m /= np.linalg.norm(m, axis=-1, keepdims=True)
        towards = m @ viewer
        down = 2.0 * towards * m[..., 2] - cos
        above = np.maximum(down, 1e-9)
        passed = np.where(down > 0.0, (1.0 + smith(alpha, cos)) / (1.0 + smith(alpha, cos) + smith(alpha, above)), 0.0)
        rows.append([passed.mean(), (passed * schlick(towards)).mean()])
    return np.array(rows).T


class Reflection:
    """Microfacets whose reflectance goes from `normal` to `grazing`; perfect ones where the roughness is 0."""

    def __init__(self, normal, grazing, roughness):
        self.normal, self.grazing = mi.Color3f(normal), mi.Color3f(grazing)
        self.is_perfect = roughness == 0.0
        self.alpha = max(roughness, LEAST_ROUGHNESS) ** 2
        self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        self.tables = [] if self.is_perfect else [mi.Float(row.astype(np.float32)) for row in albedos(roughness)]

    def once(self, cos):
        if self.is_perfect:
            return mi.Float(1.0), schlick(cos)
        place = dr.sqrt(dr.clip(cos, 0.0, 1.0)) * (NODES - 1)
        node = dr.minimum(mi.UInt32(place), NODES - 2)
        part = place - mi.Float(node)
        return [dr.lerp(dr.gather(mi.Float, t, node), dr.gather(mi.Float, t, node + 1), part) for t in self.tables]

    def given_back(self, cos):
        """Factor for what single reflection loses (Turquin, 2019)."""
        white, _ = self.once(cos)
        return 1.0 + self.normal * ((1.0 - white) / white)

    def albedo(self, cos):
        """What is reflected towards a viewer at this cosine, of a uniform light."""
        white, grown = self.once(cos)
        return self.given_back(cos) * (self.normal * white + (self.grazing - self.normal) * grown)

    def reflectance(self, viewer, cos):
        """Of microfacets at the cosine `cos` to the viewer, whose direction is `viewer`."""
        return self.given_back(viewer.z) * (self.normal + (self.grazing - self.normal) * schlick(cos))

    def eval(self, viewer, light):
        """Times the cosine of the light."""
        half = dr.normalize(viewer + light)
        masking = 1.0 / (1.0 + smith(self.alpha, viewer.z) + smith(self.alpha, light.z))
        return self.reflectance(viewer, dr.dot(viewer, half)) * self.facets.eval(half) * masking / (4.0 * viewer.z)

    def pdf(self, viewer, light):
        half = dr.normalize(viewer + light)
        return self.facets.pdf(viewer, half) / (4.0 * dr.dot(viewer, half))

    def sample(self, viewer, u):
        half, _ = self.facets.sample(viewer, u)
        return mi.reflect(viewer, half)


class Layers(mi.BSDF):
    """`principled` without images and transmission."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        number = lambda name, default: float(props.get(name, default))
        self.base = [float(props.get(f"base_{channel}")) for channel in "rgb"]
        self.metallic = number("metallic", 0.0)
        at_normal = ((number("ior", 1.5) - 1.0) / (number("ior", 1.5) + 1.0)) ** 2
        roughness = number("roughness", 0.5)
        self.shine = Reflection([at_normal] * 3, [1.0] * 3, roughness)
        self.metal = Reflection(self.base, [1.0] * 3, roughness)
        coat = number("clearcoat", 0.0)
        self.coat = Reflection([0.04 * coat] * 3, [coat] * 3, number("clearcoat_roughness", 0.03)) if coat > 0.0 else None
        kind = mi.BSDFFlags.DeltaReflection if self.shine.is_perfect else mi.BSDFFlags.GlossyReflection
        flags = [mi.BSDFFlags.DiffuseReflection, kind, mi.BSDFFlags.GlossyReflection]
        self.m_components = [flag | mi.BSDFFlags.FrontSide for flag in flags]
        self.m_flags = self.m_components[0] | self.m_components[1] | self.m_components[2]
        # Shares of samples: diffuse, mirror, coat.
        shares = [float(self.metallic < 1.0), 1.0, float(self.coat is not None)]
        self.shares = [share / sum(shares) for share in shares]

    def weights(self, viewer):
        """Albedo of the diffuse part, and what the coat lets through."""
        passed = 1.0 - self.coat.albedo(viewer.z) if self.coat else mi.Color3f(1.0)
        kept = 1.0 - dr.max(self.shine.albedo(viewer.z))
        return mi.Color3f(self.base) * ((1.0 - self.metallic) * kept) * passed, passed

    def mirror(self, of):
        """Metal and what is no metal, each by its own formula."""
        return of(self.shine) * (1.0 - self.metallic) + of(self.metal) * self.metallic

    def eval_pdf(self, ctx, si, wo, active=True):
        viewer, light = si.wi, wo
        active &= (viewer.z > 0.0) & (light.z > 0.0)
        albedo, passed = self.weights(viewer)
        value = albedo * (light.z / dr.pi)
        pdf = self.shares[0] * light.z / dr.pi
        if not self.shine.is_perfect:
            value += passed * self.mirror(lambda part: part.eval(viewer, light))
            pdf += self.shares[1] * self.shine.pdf(viewer, light)
        if self.coat:
            value += self.coat.eval(viewer, light)
            pdf += self.shares[2] * self.coat.pdf(viewer, light)
        return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, u, uv, active=True):
        viewer = si.wi
        active &= viewer.z > 0.0
        is_diffuse = u < self.shares[0]
        is_coat = u >= self.shares[0] + self.shares[1]
        light = mi.warp.square_to_cosine_hemisphere(uv)
        perfect = mi.Vector3f(-viewer.x, -viewer.y, viewer.z)
        mirrored = perfect if self.shine.is_perfect else self.shine.sample(viewer, uv)
        light = dr.select(is_diffuse, light, mirrored)
        if self.coat:
            light = dr.select(is_coat, self.coat.sample(viewer, uv), light)
        value, pdf = self.eval_pdf(ctx, si, light, active)
        weight = dr.select(pdf > 0.0, value / pdf, 0.0)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.pdf, bs.eta = light, pdf, 1.0
        bs.sampled_component = dr.select(is_diffuse, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        if self.shine.is_perfect:
            is_perfect = ~is_diffuse & ~is_coat
            _, passed = self.weights(viewer)
            share = passed * self.mirror(lambda part: part.reflectance(viewer, viewer.z)) / self.shares[1]
            weight = dr.select(is_perfect, share, weight)
            bs.pdf = dr.select(is_perfect, self.shares[1], bs.pdf)
            bs.sampled_type = dr.select(is_perfect, mi.UInt32(+mi.BSDFFlags.DeltaReflection), bs.sampled_type)
        return bs, dr.select(active, weight, 0.0)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "Layers[]"


mi.register_bsdf("layers", Layers)


class GivenBack(mi.BSDF):
    """Mitsuba's rough glass with what it loses to light that meets a second microfacet given back (docs/decisions/033)."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        keys = {"int_ior": float(props.get("ior", 1.5)), "ext_ior": 1.0, "alpha": float(props.get("alpha"))}
        self.glass = mi.load_dict({"type": "roughdielectric", "distribution": "ggx", **keys})
        self.m_components = [self.glass.flags(i) for i in range(self.glass.component_count())]
        self.m_flags = self.glass.flags()
        self.tables = [self.passed(side) for side in (1.0, -1.0)]

    def passed(self, side, samples=128):
        """What is reflected and let through of light from one side, by cosine: by the samples of Mitsuba's own glass."""
        k = np.arange(NODES * samples * samples)
        cos = np.maximum(np.linspace(0.0, 1.0, NODES), 1e-3)[k // (samples * samples)] ** 2
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = mi.Vector3f(*(mi.Float(x.astype(np.float32)) for x in (np.sqrt(1.0 - cos**2), 0.0 * cos, side * cos)))
        random = [mi.Float(x.astype(np.float32)) for x in np.random.default_rng(1).random((3, len(k)))]
        # Radiance is not scaled by the square of the index.
        ctx = mi.BSDFContext(mi.TransportMode.Importance)
        _, weight = self.glass.sample(ctx, si, random[0], mi.Point2f(*random[1:]))
        shares = np.array(weight).reshape(3, -1)[0] if np.array(weight).shape[0] == 3 else np.array(weight)[:, 0]
        return mi.Float(shares.reshape(NODES, -1).mean(axis=1).astype(np.float32))

    def factor(self, si):
        cos = si.wi.z
        place = dr.sqrt(dr.clip(dr.abs(cos), 0.0, 1.0)) * (NODES - 1)
        node = dr.minimum(mi.UInt32(place), NODES - 2)
        at = lambda t: dr.lerp(dr.gather(mi.Float, t, node), dr.gather(mi.Float, t, node + 1), place - mi.Float(node))
        return 1.0 / dr.select(cos > 0.0, *(at(table) for table in self.tables))

    def eval(self, ctx, si, wo, active=True):
        return self.glass.eval(ctx, si, wo, active) * self.factor(si)

    def pdf(self, ctx, si, wo, active=True):
        return self.glass.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        value, pdf = self.glass.eval_pdf(ctx, si, wo, active)
        return value * self.factor(si), pdf

    def sample(self, ctx, si, u, uv, active=True):
        bs, weight = self.glass.sample(ctx, si, u, uv, active)
        return bs, weight * self.factor(si)

    def traverse(self, callback):
        pass

    def to_string(self):
        return "GivenBack[]"


mi.register_bsdf("given_back", GivenBack)
