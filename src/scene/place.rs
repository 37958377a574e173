//! Putting worlds together: affine transforms, and one world after another.

use super::{Corners, Material, MaterialId, World, WorldMesh};
use crate::error::{Error, Result};
use crate::math::{DAffine3, DMat3, DVec3, Vec3};

/// Two scale factors that differ by no more than this share count as one.
const SAME_SCALE: f64 = 1e-9;

impl WorldMesh {
    /// Moves the mesh by `transform`, in f64. Normals follow by the inverse transpose; where
    /// `transform` mirrors, triangles are reversed, so that outside stays outside.
    ///
    /// Errors: a transform that flattens or is not finite; a vertex that it moves out of f64.
    pub fn apply_transform(&mut self, transform: &DAffine3) -> Result<()> {
        let (normal_matrix, mirrors) = normal_matrix(transform)?;
        let moved: Vec<DVec3> =
            self.positions.iter().map(|p| transform.transform_point3(*p)).collect();
        if moved.iter().any(|p| !p.is_finite()) {
            let name = &self.name;
            return Err(Error::Usage(format!("`{name}` is moved beyond the largest number")));
        }
        self.positions = moved;
        if let Some(normals) = &mut self.normals {
            let turn = |n: &Vec3| (normal_matrix * n.as_dvec3()).normalize_or_zero().as_vec3();
            normals.values.iter_mut().for_each(|n| *n = turn(n));
        }
        if mirrors {
            reverse(&mut self.triangles);
            self.normals.iter_mut().for_each(reverse_corners);
            self.uv_sets_mut().for_each(reverse_corners);
        }
        Ok(())
    }
}

impl World {
    /// Takes in a material; gives the number by which meshes and spheres name it.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        self.materials.len() as MaterialId - 1
    }

    /// Moves everything by `transform`: meshes, spheres, lights, the box of fog and the boxes in which light is
    /// always traced; the environment is turned. The intensity of point and spot lights, the irradiance of directional ones and the
    /// absorption of glass and the extinction of fog stay; a turned box in which light is traced becomes the upright one around it.
    ///
    /// Errors: as [`WorldMesh::apply_transform`]; spheres, disk lights, spot lights and environments under a transform that is no
    /// similarity, since they would not stay round; fog in a box under a transform that turns. The world is then half moved: drop it.
    pub fn apply_transform(&mut self, transform: &DAffine3) -> Result<()> {
        let (_, mirrors) = normal_matrix(transform)?;
        // Materials stay as they are given, and the sky's radiance is the same in all directions.
        let World {
            meshes,
            spheres,
            materials: _,
            textures: _,
            masks: _,
            lights,
            sky: _,
            environment,
            fog,
            traced_regions,
        } = self;
        meshes.iter_mut().try_for_each(|mesh| mesh.apply_transform(transform))?;
        for sphere in spheres {
            move_sphere(&sphere.name, &mut sphere.centre, &mut sphere.radius, transform)?;
        }
        lights.iter_mut().try_for_each(|light| light.transform(transform, mirrors))?;
        environment.iter_mut().try_for_each(|sky| sky.transform(transform))?;
        fog.iter_mut().try_for_each(|fog| fog.transform(transform))?;
        traced_regions.iter_mut().for_each(|region| *region = region.transformed(transform));
        Ok(())
    }

    /// Adds all that `other` holds, with its indices shifted. Sky, environment and fog stay this world's.
    pub fn append(&mut self, other: World) {
        let World {
            mut meshes,
            mut spheres,
            mut materials,
            textures,
            masks,
            lights,
            sky: _,
            environment: _,
            fog: _,
            traced_regions,
        } = other;
        let first_material = self.materials.len() as u32;
        let first_texture = self.textures.len() as u32;
        meshes.iter_mut().for_each(|mesh| mesh.material += first_material);
        spheres.iter_mut().for_each(|sphere| sphere.material += first_material);
        for texture in materials.iter_mut().flat_map(Material::images_mut) {
            texture.image += first_texture;
        }
        let first_mask = self.masks.len() as u32;
        for mask in materials.iter_mut().filter_map(|m| m.alpha.as_mut()) {
            mask.image += first_mask;
        }
        self.meshes.append(&mut meshes);
        self.spheres.append(&mut spheres);
        self.materials.append(&mut materials);
        self.textures.extend(textures);
        self.masks.extend(masks);
        self.lights.extend(lights);
        self.traced_regions.extend(traced_regions);
    }
}

/// The inverse transpose of the linear part, up to a positive factor, and whether it mirrors.
fn normal_matrix(transform: &DAffine3) -> Result<(DMat3, bool)> {
    let m = transform.matrix3;
    // Scaled to about 1 first: products of tiny columns would underflow.
    let size = m.to_cols_array().iter().fold(0f64, |size, x| size.max(x.abs()));
    let unit = m * (1.0 / size);
    let det = unit.determinant();
    if !transform.is_finite() || !unit.is_finite() || det == 0.0 {
        let message = "a transform that flattens or is not finite: check scale and rotation";
        return Err(Error::Usage(message.into()));
    }
    let (x, y, z) = (unit.x_axis, unit.y_axis, unit.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    Ok((cofactors * det.signum(), det < 0.0))
}

fn reverse(triangles: &mut [[u32; 3]]) {
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
}

fn reverse_corners<T>(corners: &mut Corners<T>) {
    corners.corners.iter_mut().for_each(|c| reverse(c));
}

pub(super) fn move_sphere(
    name: &str,
    centre: &mut DVec3,
    radius: &mut f64,
    transform: &DAffine3,
) -> Result<()> {
    let instead = ", or a sphere made of triangles";
    *radius *= uniform_scale(&format!("`{name}` is an exact sphere"), instead, transform)?;
    *centre = transform.transform_point3(*centre);
    Ok(())
}

/// By how much `transform` scales, in all directions alike.
///
/// Errors: a scale that differs by direction; `what` cannot follow it, and `instead` says what could.
pub(super) fn uniform_scale(what: &str, instead: &str, transform: &DAffine3) -> Result<f64> {
    let m = transform.matrix3;
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let scale = x.length();
    let near = |value: f64, target: f64| (value - target).abs() <= SAME_SCALE * scale;
    let skew = [x.dot(y), y.dot(z), z.dot(x)].map(|d| d / scale);
    if near(y.length(), scale) && near(z.length(), scale) && skew.iter().all(|d| near(*d, 0.0)) {
        return Ok(scale);
    }
    Err(Error::Usage(format!(
        "{what}, which a scale that differs by direction would deform; use the same scale in x, y \
         and z{instead}"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Bounds3, DQuat, Rgb};
    use crate::scene::{AlphaMask, Light, QuadLight, WorldSphere};

    fn triangle() -> WorldMesh {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 1.0, 1.0)];
        WorldMesh {
            normals: Some(Corners {
                values: vec![Vec3::new(0.0, -1.0, 1.0).normalize()],
                corners: Some(vec![[0, 0, 0]]),
            }),
            uvs: Some(Corners { values: vec![], corners: Some(vec![[5, 6, 7]]) }),
            more_uvs: vec![None, Some(Corners { values: vec![], corners: Some(vec![[1, 2, 3]]) })],
            ..WorldMesh::new("t", corners.into(), vec![[0, 1, 2]], 0)
        }
    }

    fn plane(mesh: &WorldMesh) -> DVec3 {
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).normalize()
    }

    #[test]
    fn normals_stay_those_of_the_surface_and_outside_stays_outside() {
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0);
        for scale in [DVec3::ONE, DVec3::new(2.0, 1.0, 1e-3), DVec3::new(-1.0, 3.0, 1.0)] {
            for size in [1e-200, 1.0, 1e200] {
                let transform =
                    DAffine3::from_scale_rotation_translation(scale * size, turn, DVec3::ONE);
                let mut mesh = triangle();
                mesh.apply_transform(&transform).expect("a good transform");
                let normal = mesh.normals.as_ref().expect("normals").values[0].as_dvec3();
                if size == 1.0 {
                    // The plane follows by the winding, the normal by the matrix.
                    assert!(normal.angle_between(plane(&mesh)) < 1e-6, "{scale} {size:e}");
                }
                assert!((normal.length() - 1.0).abs() < 1e-6);
                let mirrored = scale.x < 0.0;
                let uvs =
                    |set| mesh.uv_set(set).and_then(|uv| uv.corners.as_ref()).expect("corners")[0];
                assert_eq!(uvs(0), if mirrored { [5, 7, 6] } else { [5, 6, 7] });
                assert_eq!(uvs(2), if mirrored { [1, 3, 2] } else { [1, 2, 3] });
            }
        }
    }

    #[test]
    fn singular_and_non_finite_transforms_are_errors() {
        for scale in [DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO, DVec3::splat(f64::NAN)] {
            assert!(triangle().apply_transform(&DAffine3::from_scale(scale)).is_err());
        }
        assert!(triangle().apply_transform(&DAffine3::from_translation(DVec3::INFINITY)).is_err());
    }

    fn with_sphere() -> World {
        let light = QuadLight {
            corners: [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::new(0.0, 1.0, 1.0)],
            radiance: Rgb::ONE,
            two_sided: false,
        };
        World {
            spheres: vec![WorldSphere::new("ball", DVec3::X, 2.0, 0)],
            materials: vec![Material {
                texture: Some(crate::scene::TextureMap::of(0)),
                roughness_map: Some(crate::scene::TextureMap::of(0)),
                alpha: Some(crate::scene::TextureMap::of(0)),
                ..Material::black("m")
            }],
            lights: vec![Light::Quad(light)],
            ..World::default()
        }
    }

    #[test]
    fn spheres_take_similarities_only() {
        let turn = DQuat::from_rotation_z(0.7);
        let similar = DAffine3::from_scale_rotation_translation(DVec3::splat(-3.0), turn, DVec3::Y);
        let mut world = with_sphere();
        world.apply_transform(&similar).expect("a similarity");
        assert!((world.spheres[0].radius - 6.0).abs() < 1e-12);
        let [Light::Quad(light)] = &world.lights[..] else { panic!("one quad") };
        // A mirror image of a lamp still shines away from its back.
        let before = DVec3::new(0.0, -1.0, 1.0).normalize();
        assert!(light.normal().dot(turn * -before) > 0.999);
        let error = with_sphere().apply_transform(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.1)));
        assert!(error.is_err_and(|e| e.to_string().contains("`ball` is an exact sphere")));
    }

    #[test]
    fn regions_follow_the_geometry_that_they_hold() {
        let region = Bounds3 { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(3.0, 1.0, 2.5) };
        let moved = |region, transform: &DAffine3| {
            let mut world = World { traced_regions: vec![region], ..World::default() };
            world.apply_transform(transform).expect("a good transform");
            world.traced_regions[0]
        };
        let mirror = DAffine3::from_scale_rotation_translation(
            DVec3::new(-2.0, 1.0, 1.0),
            DQuat::IDENTITY,
            DVec3::X,
        );
        let expected = Bounds3 { min: DVec3::new(-5.0, 0.0, 2.0), max: DVec3::new(3.0, 1.0, 2.5) };
        assert_eq!(moved(region, &mirror), expected);
        // The upright box around a turned one: it holds every point of it, and is no larger.
        let turn = DAffine3::from_rotation_z(0.7);
        let around = moved(region, &turn);
        let (sin, cos) = 0.7f64.sin_cos();
        assert!(
            (around.extent() - DVec3::new(4.0 * cos + sin, 4.0 * sin + cos, 0.5)).length() < 1e-12
        );
        assert!((around.centre() - turn.transform_point3(region.centre())).length() < 1e-12);
        assert!(moved(Bounds3::EMPTY, &turn).is_empty());
    }

    #[test]
    fn appended_indices_are_shifted() {
        let mut world = with_sphere();
        world.textures = vec![];
        let mut other = with_sphere();
        other.meshes.push(triangle());
        let image = crate::scene::Texture::from_linear("image", [1, 1], vec![Rgb::ONE]);
        world.textures.push(image);
        for name in ["fence", "leaf"] {
            let (width, height, texels) = (1, 1, vec![0]);
            world.masks.push(AlphaMask { name: name.into(), width, height, texels });
        }
        world.append(other);
        let image = |material: &Material| material.texture.expect("a texture").image;
        assert_eq!((world.meshes[0].material, world.spheres[1].material), (1, 1));
        assert_eq!(world.materials.iter().map(image).collect::<Vec<_>>(), [0, 1]);
        let rough = world.materials[1].roughness_map.expect("a roughness map");
        assert_eq!(rough.image, 1);
        let mask = |material: &Material| material.alpha.expect("a mask").image;
        assert_eq!(world.materials.iter().map(mask).collect::<Vec<_>>(), [0, 2]);
    }
}
