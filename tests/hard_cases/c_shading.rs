//! C. Shading, normals, glass.

mod camera;
mod edges;
mod furnace;
mod glass;
mod lights;
mod nested;
mod normals;
mod samples;
mod turned;

use crate::suite::cases;

cases! {
    32 normal_transform "matrix instead of its inverse transpose: 36.87 degrees off on diag(2,1,1)" => normals::normal_transform;
    33 turned_mesh_or_camera "the published image of an earlier renderer turned mesh and normals apart" => turned::turned_mesh_or_camera;
    34 reversed_winding "pbrt-v3 #129: reversed orientation flips glass" => turned::reversed_winding;
    35 fresnel_snell "Mitsuba: 20 angles within 1e-5" => glass::fresnel_snell;
    36 glass_ball "closed form; raytracing in one weekend #889" => glass::glass_ball;
    37 light_guide "pbrt allows 0.025" => glass::light_guide;
    38 nested_dielectrics "boundaries relative to air: an air film where bodies touch" => nested::nested_dielectrics;
    39 white_furnace "pbrt allows 0.025" => furnace::white_furnace;
    40 energy "pbrt: albedo up to 1.01, 16,384 samples x 10 directions" => furnace::energy;
    41 bad_samples "pbrt writes 0 in their place" => samples::bad_samples;
    42 camera_degeneracies "up along the view" => camera::camera_degeneracies;
    43 area_light_extremes "radius 0, point inside, horizon" => lights::area_light_extremes;
    44 thin_rim "error of a pixel's share falls with the root of its samples" => edges::thin_rim;
}
