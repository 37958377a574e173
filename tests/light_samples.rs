//! Shadow and sky samples from the least to the most: pilots that agree end a point's rays.

mod common;

use common::TestSet;
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::Rgb;
use tweenray::scene::{Policy, Settings};
use tweenray::shade::Renderer;
use tweenray::stats::{RayCounts, RayKind};
