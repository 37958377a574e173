//! Camera rays in the order of the renderer's blocks.

use tweenray::intersect::Ray;
use tweenray::scene::Camera;

/// Rays handed over at once: the kernel's, one sample of an 8 x 8 block.
pub const BLOCK: usize = 64;

/// A ray through the middle of every pixel; the first is that of the first block's corner.
pub fn all(camera: &Camera) -> Vec<Ray> {
    let mut rays = Vec::new();
    each_block(camera, |block| block.iter().for_each(|ray| rays.push(*ray)));
    rays
}

/// Calls `with` with the rays of each block of 8 x 8 pixels, in 4 x 4 sub-blocks.
pub fn each_block(camera: &Camera, mut with: impl FnMut(&[Ray])) {
    let mut block = Vec::with_capacity(BLOCK);
    for by in (0..camera.height).step_by(8) {
        for bx in (0..camera.width).step_by(8) {
            block.clear();
            for k in 0..BLOCK as u32 {
                let x = bx + k / 16 % 2 * 4 + k % 4;
                let y = by + k / 32 * 4 + k % 16 / 4;
                let dir = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
                block.push(Ray::new(camera.eye, dir));
            }
            with(&block);
        }
    }
}
