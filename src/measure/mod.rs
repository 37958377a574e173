//! How far two pictures are apart, and how sure a figure is. Pure functions on data: nothing
//! here reads a file or prints.
//!
//! * [`compare`] takes two [`Image`](crate::film::Image)s and gives a [`Comparison`]:
//!   [`mse`], RMSE, [`psnr`], [`largest_error`], [`ssim`], [`ssim_blocks`] and [`flip`].
//! * [`proportion_upper_bound`] and [`drawn_sum_interval`] bound shares and totals at 95 %
//!   confidence; [`median`] does so for the middle of a few times.
//!
//! **Which numbers are compared.** Two display-encoded files (png, ppm, jpeg) are compared as
//! they are, in sRGB code values. Two linear files (exr, hdr) are compared in linear radiance
//! clipped to [0, 1] for MSE, RMSE, PSNR and the largest error; SSIM, FLIP and the shares of
//! pixels off by display steps are about what an eye sees on a display, and take the same values
//! sRGB-encoded. Of a mixed pair the linear one is sRGB-encoded first, without exposure or tone
//! curve. [`Comparison::space`] says which it was.
//!
//! Every sum is taken per row in f64 and then row by row, so no figure depends on the number of
//! threads.
//!
//! Not done: HDR-FLIP (Andersson et al., 2021), which searches exposures; MS-SSIM.

mod compare;
mod error_metrics;
mod filter;
mod flip;
mod intervals;
mod median;
mod ssim;
#[cfg(test)]
mod test_images;

pub use compare::{Comparison, Exceeding, Space, Summary, compare, summarise};
pub use error_metrics::{LargestError, largest_error, mse, psnr, share_exceeding};
pub use flip::{PIXELS_PER_DEGREE, flip, flip_map};
pub use intervals::{
    CONFIDENCE, Interval, drawn_sum_interval, most_by_chance, proportion_upper_bound,
};
pub use median::{Median, median};
pub use ssim::{ssim, ssim_blocks};
