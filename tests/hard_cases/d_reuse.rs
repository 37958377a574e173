//! D. Reuse between frames.

mod audited;
mod defocus;
mod fence;
mod identity;
mod specular;
mod still;

use crate::suite::cases;

cases! {
    45 identity_path "no public test" => still::identity_path;
    46 audited_reuse "no public test: nobody states the error of inferred frames" => audited::audited_reuse;
    47 exactness_and_savings "Adelson and Hodges: 96 % of the rays saved" => fence::exactness_and_savings;
    48 disocclusion "stable ray tracing: every hole traced again" => fence::disocclusion;
    49 moving_highlight "caches that keep specular colour drag it along" => specular::moving_highlight;
    50 no_accumulated_blur "Yang et al., 2009: blur that grows from frame to frame" => still::no_accumulated_blur;
    51 scene_change "V-Ray: the cache is the user's to delete" => identity::scene_change;
    52 order_independence "LuxCore 668: it depends on the threads" => identity::order_independence;
    64 reuse_under_defocus "no public test: caches of the field know pinholes" => defocus::defocus;
}
