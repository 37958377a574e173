//! Cut-outs: whether a surface is there where a ray meets it.
//!
//! The answer is a function of primitive and ray, as the ray was asked for: not as Embree sees it, moved or
//! turned, and not of an intersector's rounded hit. Embree's filter, the oracle, the recheck and `verify` all ask
//! here. So a ray sees the same primitives in both intersectors, and every rule of theirs holds among these.
//!
//! A mesh without texture coordinates has no holes, as nothing says where they lie. Not done: partial cover.

use super::interaction::{sphere_normal, sphere_uv, uv_at};
use super::{PrimRef, Ray, coincident, sphere, triangle};
use crate::embree::Holes;
use crate::scene::{LaidMask, Mesh, Scene, Sphere};

/// Whether the triangle `prim` is there where the line of `ray` meets it or, where it passes the triangle by, at
/// the nearest point of the outline. A sphere always is: [`sphere_root`] looks at its roots.
pub fn is_there(scene: &Scene, ray: &Ray, prim: PrimRef) -> bool {
    let mesh = scene.meshes.get(prim.geom_id as usize);
    let masked = mesh.and_then(|mesh| Some((mesh, scene.mesh_mask(mesh)?)));
    masked.is_none_or(|(mesh, mask)| covers_triangle(mask, mesh, ray, prim.prim_id))
}

/// Where `ray` first hits sphere number `prim.prim_id` between its ends; a hole is no hit.
///
/// # Panics
/// When `prim` is no sphere.
pub fn sphere_root(scene: &Scene, ray: &Ray, prim: PrimRef) -> Option<f64> {
    let s = &scene.spheres[prim.prim_id as usize];
    let is_there = |t| scene.mask(s.surface).is_none_or(|mask| covers_sphere(mask, s, ray, t));
    let leaving = coincident::starts_on(scene, ray, prim);
    sphere::first_root(ray, s.centre, s.radius, leaving, is_there)
}

fn covers_triangle(mask: LaidMask, mesh: &Mesh, ray: &Ray, prim_id: u32) -> bool {
    let prim = prim_id as usize;
    let Some(uvs) = mask.uvs(mesh) else { return true };
    let Some(met) = triangle::meet_or_nearest(ray, &mesh.corners(prim)) else { return true };
    let weights = [1.0 - met.u - met.v, met.u, met.v];
    let at = uvs.get(prim, mesh.triangles[prim]);
    // A face without coordinates in a file that has some for others: (0, 0) three times.
    let is_laid = at[0] != at[1] || at[1] != at[2];
    !is_laid || mask.is_there(uv_at(at, weights))
}

fn covers_sphere(mask: LaidMask, sphere: &Sphere, ray: &Ray, t: f64) -> bool {
    mask.is_there(sphere_uv(sphere_normal(sphere, ray, t)))
}

/// The cut-outs of a scene as Embree's filter asks for them.
///
/// Of primitives at the same place the lowest that is there is hit. Embree would report any of them, so one
/// that lies behind another, of a higher number, is not there where the other one is.
pub(super) struct CutOuts<'s> {
    scene: &'s Scene,
    /// The mask of each mesh.
    masks: Vec<Option<LaidMask<'s>>>,
    /// Whether any sphere has a mask.
    on_spheres: bool,
    /// Primitives and the next lower one at the same place that has holes, ascending.
    behind: Vec<(PrimRef, PrimRef)>,
}

impl<'s> CutOuts<'s> {
    /// The cut-outs of `scene`, unless nothing in it has any. `behind` is [`super::coincident`]'s.
    pub fn of(scene: &'s Scene, behind: Vec<(PrimRef, PrimRef)>) -> Option<Self> {
        let masks: Vec<_> = scene.meshes.iter().map(|mesh| scene.mesh_mask(mesh)).collect();
        let on_spheres = scene.spheres.iter().any(|s| scene.mask(s.surface).is_some());
        let any = on_spheres || masks.iter().any(Option::is_some);
        any.then_some(Self { scene, masks, on_spheres, behind })
    }

    /// Whether the primitive covers the place where `ray` meets it, whatever lies there besides.
    fn covers(&self, ray: &Ray, prim: PrimRef, root: usize) -> bool {
        match self.masks.get(prim.geom_id as usize) {
            Some(None) => true,
            Some(Some(mask)) => {
                let mesh = &self.scene.meshes[prim.geom_id as usize];
                covers_triangle(*mask, mesh, ray, prim.prim_id)
            }
            None => self.covers_root(ray, &self.scene.spheres[prim.prim_id as usize], root),
        }
    }

    fn covers_root(&self, ray: &Ray, s: &Sphere, root: usize) -> bool {
        let Some(mask) = self.scene.mask(s.surface) else { return true };
        // Rounded to f32 the ray meets the sphere, as it is it does not: the recheck decides.
        let Some(roots) = sphere::roots(ray, s.centre, s.radius) else { return true };
        covers_sphere(mask, s, ray, roots[root])
    }

    /// Whether `ray` starts on the sphere `prim` where it meets it.
    fn is_start(&self, ray: &Ray, prim: PrimRef, root: usize) -> bool {
        let starts = coincident::starts_on(self.scene, ray, prim);
        let s = starts.then(|| &self.scene.spheres[prim.prim_id as usize]);
        let roots = s.and_then(|s| sphere::roots(ray, s.centre, s.radius));
        roots.is_some_and(|roots| sphere::end_of_leaving(roots) != Some(root))
    }

    fn next_lower(&self, prim: PrimRef) -> Option<PrimRef> {
        let at = self.behind.binary_search_by_key(&prim, |(higher, _)| *higher).ok()?;
        Some(self.behind[at].1)
    }
}

impl Holes for CutOuts<'_> {
    fn are_in(&self, geom_id: u32) -> bool {
        let first = self.behind.partition_point(|(higher, _)| higher.geom_id < geom_id);
        let is_behind = self.behind.get(first).is_some_and(|(prim, _)| prim.geom_id == geom_id);
        is_behind || self.masks.get(geom_id as usize).map_or(self.on_spheres, Option::is_some)
    }

    fn is_there(&self, ray: &Ray, prim: PrimRef, root: usize) -> bool {
        let lower = std::iter::successors(self.next_lower(prim), |prim| self.next_lower(*prim));
        self.covers(ray, prim, root)
            && !lower.into_iter().any(|low| self.covers(ray, low, root))
            && !self.is_start(ray, prim, root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::coincident;
    use crate::math::{DVec3, Rgb, Vec2};
    use crate::scene::{AlphaMask, Corners, Material, TextureMap, World, WorldMesh, WorldSphere};

    #[test]
    fn only_geometries_with_holes_are_asked() {
        let mut world = World::default();
        let texels = vec![0];
        world.masks.push(AlphaMask { name: "m".into(), width: 1, height: 1, texels });
        let white = Material::diffuse("white", Rgb::ONE);
        let leaf = Material { alpha: Some(TextureMap::of(0)), ..white.clone() };
        let (leaf, white) = (world.add_material(leaf), world.add_material(white));
        for (x, material) in [(0.0, leaf), (1.0, white)] {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| p + DVec3::Z * x).to_vec();
            let values = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
            let uvs = Some(Corners { values, corners: None });
            let mesh = WorldMesh::new("triangle", corners, vec![[0, 1, 2]], material);
            world.meshes.push(WorldMesh { uvs, ..mesh });
        }
        world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, white));
        let asked = |world: &World| {
            let scene = world.clone().into_scene(false).expect("a scene");
            let behind = coincident::copies(&scene).behind;
            let cut_outs = CutOuts::of(&scene, behind).expect("some have holes");
            [0, 1, scene.sphere_geom_id()].map(|geom_id| cut_outs.are_in(geom_id))
        };
        assert_eq!(asked(&world), [true, false, false]);
        world.spheres.push(WorldSphere::new("leaf", DVec3::ONE, 1.0, leaf));
        assert_eq!(asked(&world), [true, false, true]);
    }
}
