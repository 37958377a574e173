//! Bodies of glass in one another: which of them is there, and where one really ends.
//!
//! Each body of glass with a priority is a closed surface. Where several overlap, the one of the
//! highest priority is, so a boundary counts only when nothing higher is around it (Schmidt and
//! Budge, "Simple nested dielectrics in ray traced images", 2002). A path carries the bodies that
//! it is in. Boundaries that touch are crossed at once, or what lies between them by rounding or
//! by design would decide whether light is totally reflected.
//!
//! Only the kernels for such glass use this. A body is a mesh or an exact sphere; it must be
//! closed. Of boundaries that coincide bit for bit two are told apart, not three.

use super::Renderer;
use super::lobe::Dielectric;
use crate::intersect::{Ray, SurfaceInteraction};
use crate::math::Rgb;
use crate::scene::{Glass, MaterialId, Scene};
use crate::stats::{RayCounts, RayKind};

/// Bodies that one point can be in; of more, the lowest priority is forgotten.
const MOST_BODIES: usize = 8;
/// Scene units between boundaries that touch: the gap of a model whose coordinates have six
/// decimals, and ten times what rounding positions to f32 moves them. (World units where the scene
/// is not recentred.)
const TOUCHING: f64 = 4e-6;
/// A ray sees touching boundaries further apart the flatter it meets them, down to this cosine.
const LEAST_COS: f64 = 0.05;
/// Boundaries that are crossed at once.
const MOST_TOUCHING: usize = 4;
/// Boundaries between the eye and the end of the scene.
const MOST_CROSSED: usize = 1024;

/// A body of glass: a mesh or a sphere.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Body {
    /// Mesh, or number of meshes plus sphere.
    index: u32,
    material: MaterialId,
    priority: u8,
}

impl Body {
    /// Of equal priorities the later material is higher, so that the order of entry is nothing.
    fn rank(&self) -> (u8, MaterialId) {
        (self.priority, self.material)
    }
}

/// The bodies that a point lies in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct MediumStack {
    bodies: [Body; MOST_BODIES],
    len: u8,
}

impl MediumStack {
    fn bodies(&self) -> &[Body] {
        &self.bodies[..usize::from(self.len)]
    }

    fn enter(&mut self, body: Body) {
        if self.bodies().contains(&body) {
            // A ray on an edge meets both of its triangles.
            return;
        }
        if usize::from(self.len) == MOST_BODIES {
            if let Some(lowest) = self.bodies.iter_mut().min_by_key(|b| b.rank()) {
                if lowest.rank() < body.rank() {
                    *lowest = body;
                }
            }
            return;
        }
        self.bodies[usize::from(self.len)] = body;
        self.len += 1;
    }

    fn leave(&mut self, body: Body) {
        let Some(at) = self.bodies().iter().position(|b| *b == body) else { return };
        self.len -= 1;
        self.bodies[at] = self.bodies[usize::from(self.len)];
    }

    /// What is there.
    fn medium(&self) -> Option<Body> {
        self.bodies().iter().copied().max_by_key(Body::rank)
    }

    /// The glass that is there.
    pub fn material(&self) -> Option<MaterialId> {
        self.medium().map(|body| body.material)
    }

    /// The bodies where `ray` starts, by what it leaves before it has entered it. `met` is a buffer.
    pub fn at(renderer: &Renderer, ray: &Ray, met: &mut Vec<Body>, counts: &mut RayCounts) -> Self {
        let mut inside = Self::default();
        met.clear();
        let (mut ray, dir) = (*ray, ray.dir);
        for _ in 0..MOST_CROSSED {
            counts[RayKind::Glass] += 1;
            let Some(hit) = renderer.intersector.intersect(&ray, counts) else { break };
            let si = SurfaceInteraction::new(renderer.scene, &ray, &hit);
            // A ray that starts beyond the first of several that touch would miss the others.
            let touching = Touching::at(renderer, &ray, &si, true, counts);
            for si in touching.surfaces() {
                let Some(body) = body_of(renderer.scene, si).filter(|b| !met.contains(b)) else {
                    continue;
                };
                met.push(body);
                if si.is_outside(dir) {
                    inside.enter(body);
                }
            }
            ray = touching.last().spawn(dir, renderer.settings.rules.spawn_offset);
        }
        inside
    }
}

/// The body that a surface bounds, if it is glass with a priority.
fn body_of(scene: &Scene, si: &SurfaceInteraction) -> Option<Body> {
    let glass = scene.materials[si.surface.material as usize].glass.as_ref()?;
    let priority = glass.priority?;
    let sphere = if si.prim.geom_id == scene.sphere_geom_id() { si.prim.prim_id } else { 0 };
    Some(Body { index: si.prim.geom_id + sphere, material: si.surface.material, priority })
}

/// Whether `glass` is this module's business.
pub(super) fn is_ranked(glass: &Glass) -> bool {
    glass.priority.is_some()
}

/// Touching boundaries of ranked glass, crossed at once.
pub(super) struct Crossing {
    /// The last of them: what goes through starts here.
    pub last: SurfaceInteraction,
    /// The bodies behind it.
    pub after: MediumStack,
    /// The boundary between two media, or `None` where the medium stays what it was.
    pub boundary: Option<Boundary>,
}

/// Where one medium ends and another begins.
pub(super) struct Boundary {
    /// The surface of the medium of the higher priority.
    pub surface: SurfaceInteraction,
    /// What the boundary does to light.
    pub lobe: Dielectric,
}

/// Boundaries that touch.
struct Touching {
    found: [SurfaceInteraction; MOST_TOUCHING],
    count: usize,
}

impl Touching {
    /// What touches `first`, which `ray` meets, up to something solid (which what goes through
    /// meets next), or with `solid` beyond it.
    fn at(
        renderer: &Renderer,
        ray: &Ray,
        first: &SurfaceInteraction,
        solid: bool,
        counts: &mut RayCounts,
    ) -> Self {
        let scene = renderer.scene;
        let mut found = [*first; MOST_TOUCHING];
        let mut count = 1;
        let length = ray.dir.length();
        let reach = TOUCHING / first.ng.dot(ray.dir).abs().max(LEAST_COS * length);
        // The probe starts close by, so that its rounding is that of the place: seen from a camera far
        // away, what touches would be less than an ulp of `t` apart.
        let t = (first.p - ray.org).dot(ray.dir) / (length * length);
        let back = reach.min(t - ray.tnear).max(0.0);
        let ahead = reach.min(ray.tfar - t).max(0.0);
        let org = first.p - ray.dir * back;
        let tfar = back + ahead;
        // What Embree's f32 needs to tell two boundaries apart, likewise longer the flatter they are met.
        let step = reach * (2.0 * f64::from(f32::EPSILON) * first.p.abs().max_element() / TOUCHING);
        let mut tnear = 0.0;
        for _ in 0..2 * MOST_TOUCHING {
            if count == MOST_TOUCHING || tnear >= tfar {
                break;
            }
            let exclude = found[count - 1].prim;
            let probe = Ray { org, tnear, tfar, exclude, ..*ray };
            counts[RayKind::Glass] += 1;
            let Some(hit) = renderer.intersector.intersect(&probe, counts) else { break };
            let si = SurfaceInteraction::new(scene, &probe, &hit);
            if si.prim == ray.exclude || found[..count].iter().any(|c| c.prim == si.prim) {
                // Where the ray started, or seen already: what else there is lies further on.
                tnear = if tnear < back { back } else { hit.t.max(tnear) + step };
                continue;
            }
            if !solid && body_of(scene, &si).is_none() {
                break;
            }
            found[count] = si;
            count += 1;
            tnear = hit.t.max(back) + step;
        }
        Self { found, count }
    }

    fn surfaces(&self) -> &[SurfaceInteraction] {
        &self.found[..self.count]
    }

    fn last(&self) -> &SurfaceInteraction {
        &self.found[self.count - 1]
    }
}

/// Crosses what `ray` meets at `first`; `before` are the bodies in front of it.
pub(super) fn cross(
    renderer: &Renderer,
    ray: &Ray,
    first: &SurfaceInteraction,
    before: &MediumStack,
    counts: &mut RayCounts,
) -> Crossing {
    let scene = renderer.scene;
    let touching = Touching::at(renderer, ray, first, false, counts);
    let mut after = *before;
    for (si, body) in touching.surfaces().iter().filter_map(|si| Some((si, body_of(scene, si)?))) {
        if si.is_outside(ray.dir) { after.leave(body) } else { after.enter(body) }
    }
    let boundary = boundary(scene, touching.surfaces(), before.medium(), after.medium());
    Crossing { last: *touching.last(), after, boundary }
}

fn boundary(
    scene: &Scene,
    crossed: &[SurfaceInteraction],
    before: Option<Body>,
    after: Option<Body>,
) -> Option<Boundary> {
    let material = |body: Option<Body>| body.map(|b| b.material);
    if material(before) == material(after) {
        return None;
    }
    let higher = [before, after].into_iter().flatten().max_by_key(Body::rank)?;
    let own = crossed.iter().find(|si| si.surface.material == higher.material);
    let glass = |body: &Body| scene.materials[body.material as usize].glass.as_ref();
    let ior = |body: Option<Body>| body.as_ref().and_then(glass).map_or(1.0, |g| g.ior);
    Some(Boundary {
        surface: *own.unwrap_or(&crossed[0]),
        lobe: Dielectric {
            eta: ior(after) / ior(before),
            tint: glass(&higher).map_or(Rgb::ONE, |g| g.tint),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(index: u32, priority: u8) -> Body {
        Body { index, material: index, priority }
    }

    #[test]
    fn the_highest_priority_is_there_in_any_order() {
        let (glass, tea, ice) = (body(0, 2), body(1, 1), body(2, 3));
        for order in [[glass, tea, ice], [ice, tea, glass], [tea, ice, glass]] {
            let mut inside = MediumStack::default();
            order.iter().for_each(|b| inside.enter(*b));
            assert_eq!(inside.medium(), Some(ice));
            inside.leave(ice);
            assert_eq!(inside.medium(), Some(glass));
            inside.leave(glass);
            assert_eq!(inside.medium(), Some(tea));
            inside.leave(tea);
            assert_eq!(inside.medium(), None);
        }
    }

    #[test]
    fn edges_and_strangers_do_not_count_twice() {
        let mut inside = MediumStack::default();
        inside.enter(body(0, 1));
        inside.enter(body(0, 1));
        inside.leave(body(5, 1));
        inside.leave(body(0, 1));
        assert_eq!(inside.medium(), None);
    }

    #[test]
    fn of_too_many_bodies_the_lowest_is_forgotten() {
        let ascending: Vec<Body> = (0..20).map(|i| body(i, i as u8)).collect();
        let descending: Vec<Body> = ascending.iter().rev().copied().collect();
        for order in [ascending, descending] {
            let mut inside = MediumStack::default();
            order.iter().for_each(|b| inside.enter(*b));
            assert_eq!(usize::from(inside.len), MOST_BODIES);
            for i in (20 - MOST_BODIES as u32..20).rev() {
                assert_eq!(inside.medium(), Some(body(i, i as u8)));
                inside.leave(body(i, i as u8));
            }
            assert_eq!(inside.medium(), None);
        }
    }
}
