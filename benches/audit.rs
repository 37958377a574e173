#![allow(clippy::all, clippy::print_stdout, dead_code)]
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::effects::EffectPlan;
use tweenray::film::{Film, PixelSource, Provenance};
use tweenray::import::{self, LoadOptions};
use tweenray::intersect::EmbreeIntersector;
use tweenray::output::Display;
use tweenray::math::Rgb;
use tweenray::scene::{Settings, Shot, CameraPath};
use tweenray::sequence::{FrameMaker, Inferrer, Pyramid};
use tweenray::shade::{FrameJob, Progress, Renderer};
use tweenray::stats::RayCounts;

struct Quiet;
impl Progress for Quiet { fn tile_done(&self, _: f64, _: &RayCounts) {} }
fn var<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}
fn mix(v: u64) -> u64 {
    let mut v = v.wrapping_add(0x9e37_79b9_7f4a_7c15);
    v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}
fn unit(k: u64) -> f64 { (mix(k) >> 11) as f64 / (1u64 << 53) as f64 }

struct P { d: [f64;3] }
struct Frame { w: usize, h: usize, i: Vec<Rgb>, a: Vec<Rgb>, b: Vec<Rgb>, truth: Vec<Rgb>, tr: Vec<Rgb>, src: Vec<PixelSource>, cost: f64, rays: RayCounts, pts: u64 }

fn f(d: &Display, x: Rgb, y: Rgb) -> f64 {
    let (a, b) = (d.code(x), d.code(y));
    (0..3).map(|k| (a[k]-b[k]).powi(2)).sum::<f64>() / 3.0 * 255.0*255.0
}
fn prod(d: &Display, i: Rgb, a: Rgb, b: Rgb) -> f64 {
    let (i, a, b) = (d.code(i), d.code(a), d.code(b));
    (0..3).map(|k| (i[k]-a[k])*(i[k]-b[k])).sum::<f64>() / 3.0 * 255.0*255.0
}
fn jack(d: &Display, i: Rgb, a: Rgb, b: Rgb) -> f64 { 2.0*f(d,i,(a+b)*0.5) - 0.5*(f(d,i,a)+f(d,i,b)) }
fn tj(d: &Display, a: Rgb, b: Rgb) -> f64 {
    let m = d.code((a+b)*0.5); let (a,b)=(d.code(a), d.code(b));
    (0..3).map(|k| (a[k]-b[k]).powi(2)*0.5 + 4.0/3.0*(m[k]-0.5*(a[k]+b[k])).powi(2)).sum::<f64>() / 3.0 * 255.0*255.0
}

fn main() {
    let scene_name: String = var("SCENE", "cornell".into());
    let shots: u64 = var("SHOTS", 6);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{scene_name}/scene.toml"));
    let loaded = import::load(&file, &LoadOptions::default()).expect("loads");
    let scene = loaded.world.clone().into_scene(true).expect("scene");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(var("THREADS", 2)).build().unwrap();
    let stop = AtomicBool::new(false);
    let edge: u32 = var("EDGE", 64);
    let mut results: std::collections::BTreeMap<String, [f64; 8]> = Default::default();
    for k in 0..shots {
        let samples = [4, 8, 16][k as usize % 3];
        let settings = Settings { width: edge, height: edge, spp: var("SPP", 1), shadow_samples: samples,
            sky_samples: if loaded.settings.sky_samples > 0 { samples } else { 0 }, seed: 1000 + k, ..loaded.settings.clone() };
        let best = Settings { shadow_samples: 1024, sky_samples: 1024, ..settings.clone() };
        let intersector = EmbreeIntersector::new(&scene, settings.rules, None, 4).expect("bvh");
        let mut shot = Shot { frames: var("FRAMES", 9), ..loaded.shot.clone() };
        if let CameraPath::Pan { from, to, target, .. } = &mut shot.path {
            let u = unit(k);
            let mid = (*from + *to) * 0.5;
            let part = 0.2 + 0.8 * u;
            *from = mid + (*from - mid) * part; *to = mid + (*to - mid) * part;
            target.x += 0.3 * (unit(k + 99) - 0.5);
        }
        let renderer = |s| Renderer { scene: &scene, settings: s, plan: EffectPlan::of(&scene, s), intersector: &intersector };
        let pyramid = Pyramid { segment: 64, frames: shot.frames };
        let frames: Vec<u32> = (1..=shot.frames).collect();
        let maker = Inferrer::new(renderer(&settings), &shot, &pool, &stop, &Quiet, pyramid, &frames);
        let display = Display { exposure: settings.exposure, tone: settings.tone };
        let mut data = Vec::new();
        for n in pyramid.order(&frames) {
            let made = maker.make(n).unwrap().unwrap();
            if pyramid.is_key(n) { continue; }
            let camera = shot.camera(n, settings.width, settings.height).unwrap();
            let go = |s, stream| pool.install(|| renderer(s).render_job(&FrameJob { camera: &camera, stream, with_gbuffer: false, reuse: None, mask: None }, &stop, &Quiet)).unwrap().film.rgb;
            let r = made.rays;
            let pts = made.reuse.direct + made.reuse.specular;
            let cost = r.camera as f64 + 2.0 * (r.mirror + r.glass) as f64 + 1.2 * (r.shadow_area + r.shadow_sky + r.shadow_delta) as f64 + 1.5 * pts as f64;
            data.push(Frame { w: settings.width as usize, h: settings.height as usize, a: go(&settings, n | 1<<30), b: go(&settings, n | 1<<31), truth: go(&best, n | 3 << 28), tr: go(&settings, n), src: made.film.sources.clone().unwrap(), i: made.film.rgb, cost, rays: r, pts });
        }
        // classes
        let mut names = ["penumbra", "within 1", "within 2", "within 4", "rest", "traced"].map(|n| (n, 0usize, 0.0, 0.0, 0.0));
        let mut lit = 0usize;
        let (mut ti, mut pi, mut ji, mut tt, mut pt, mut jt) = (0.0,0.0,0.0,0.0,0.0,0.0);
        let mut pops = Vec::new();
        for fr in &data {
            let risk: Vec<f32> = fr.src.iter().map(|s| s.risk).collect();
            let dil = |r: i32| -> Vec<f32> { (0..fr.w*fr.h).map(|p| { let (x,y)=((p%fr.w) as i32,(p/fr.w) as i32); let mut m=0f32; for dy in -r..=r { for dx in -r..=r { let (u,v)=(x+dx,y+dy); if u>=0&&v>=0&&(u as usize)<fr.w&&(v as usize)<fr.h { m=m.max(risk[v as usize*fr.w+u as usize]); } } } m }).collect() };
            let (d1,d2,d4) = (dil(1),dil(2),dil(4));
            let mut px = Vec::new();
            for p in 0..fr.w*fr.h {
                if fr.src[p].provenance == Provenance::Background { continue; }
                lit += 1;
                let e = f(&display, fr.i[p], fr.truth[p]);
                let t = f(&display, fr.tr[p], fr.truth[p]);
                let x = prod(&display, fr.i[p], fr.a[p], fr.b[p]);
                let j = jack(&display, fr.i[p], fr.a[p], fr.b[p]);
                let c = if fr.src[p].provenance == Provenance::Traced {5} else if risk[p]>0.0 {0} else if d1[p]>0.0 {1} else if d2[p]>0.0 {2} else if d4[p]>0.0 {3} else {4};
                names[c].1 += 1; names[c].2 += e; names[c].3 += t; names[c].4 += e*e;
                ti += e; pi += x; ji += j; tt += t; pt += 0.5*f(&display, fr.a[p], fr.b[p]); 
                let tjj = tj(&display, fr.a[p], fr.b[p]); jt += tjj;
                let slope = { let i = fr.i[p]; let x = i.max_element().max(1e-4); (tweenray::math::srgb_encode(x as f64 * 1.01) - tweenray::math::srgb_encode(x as f64 * 0.99)) / (0.02 * x as f64) };
                let slope2 = |r: f32| { let i = fr.i[p]; let x = i.max_element() as f64; (tweenray::math::srgb_encode((x+r as f64).min(1.0)) - tweenray::math::srgb_encode((x-r as f64).max(0.0))).powi(2) };
                let code = slope; let _ = code;
                let q5 = slope2(0.5*d1[p]); let q6 = slope2(0.5*d2[p]); let q4 = slope2(0.25*d1[p]);
                px.push((x, j, 0.5*f(&display, fr.a[p], fr.b[p]), tjj, risk[p], d1[p], d2[p], code, q4, q5, q6, if fr.src[p].provenance == Provenance::Traced {1.0} else {0.0}));
            }
            pops.push((px, fr.cost, fr.rays));
        }
        let all = (data.len()*data[0].w*data[0].h) as f64;
        println!("shot {k} samples {samples}: lit {:.2} true I {:.3} prod {:.3} jack {:.3} | true T {:.3} prod {:.3} jack {:.3}", lit as f64/all, (ti/all).sqrt(), (pi/all).sqrt(), (ji/all).sqrt(), (tt/all).sqrt(), (pt/all).sqrt(), (jt/all).sqrt());
        for (n, c, e, t, ee) in names { print!("  {n}: {:.1}% px, {:.1}% of I, {:.1}% of T, rms {:.2}, kurt {:.0};", 100.0*c as f64/lit as f64, 100.0*e/ti, 100.0*t/tt, (e/c.max(1) as f64).sqrt(), ee/(c.max(1) as f64)/(e/c.max(1) as f64).powi(2)); }
        println!();
        // simulate
        for (design, mixture) in [("half d1",6),("d1+d2", 2)] {
            for share in [var("SHARE", 0.03)] {
            for rep in 0..200u64 {
                let mut sums = [[0.0;3]; 4]; // sum, squares, largest
                let mut n = 0;
                for (fi, (px, cost, rays)) in pops.iter().enumerate() {
                    let s = (rays.mirror + rays.glass) as f64 / rays.camera as f64;
                    let lights = scene.lights.len() as f64 * samples as f64 + if settings.sky_samples > 0 && scene.sky.lights { samples as f64 } else {0.0};
                    let each = 2.0 * settings.spp as f64 * (1.0 + 2.0*s + (1.0+s)*1.2*lights);
                    let budget = share * cost / each;
                    let mt: f64 = px.iter().map(|p| if p.11 > 0.0 { p.9 } else {0.0}).sum::<f64>() / px.iter().filter(|p| p.11 > 0.0).count().max(1) as f64;
let _ = mt;
let q: Vec<f64> = px.iter().map(|p| match mixture { 0 => p.8, 1 => p.9, 2 => p.9 + 0.3 * p.10, 3 => p.9 * (1.0 + 2.0*p.11), 4 => p.9.sqrt(), 5 => p.10*(1.0 + 2.0*p.11), _ => p.9 }).collect();
                    let def = 0.33;
                    let total: f64 = q.iter().sum::<f64>().max(1e-9);
                    let np = px.len() as f64;
                    let (mut acc, mut run) = (0.0, 0u64);
                    let mut target = unit(mix(rep*1000+fi as u64));
                    for (p, q) in px.iter().zip(&q) {
                        let pr = (budget * (def/np + (1.0-def)*q/total)).min(1.0);
                        acc += pr;
                        while acc > target {
                            n += 1;
                            for (s, v) in sums.iter_mut().zip([p.0,p.1,p.2,p.3]) { let y = v/pr; s[0]+=y; s[1]+=y*y; s[2]=s[2].max(y).max(1.0/pr); }
                            run += 1;
                            target = run as f64 + unit(mix(rep*1000+fi as u64) ^ run.wrapping_mul(77777));
                        }
                    }
                }
                for (m, name, tru) in [(1,"I jack", ti),(3,"T jack", tt)] { for kk in [1.0, 1.5, 2.0,3.0] {
                    let [lo, hi] = interval(sums[m], kk);
                    let r = results.entry(format!("{name} {design:10} {kk}")).or_default();
                    r[0] += 1.0; if tru < lo { r[1] += 1.0 } if tru > hi { r[2] += 1.0 }
                    r[3] += ((hi/ tru).sqrt() - (lo / tru).sqrt()); r[4] += n as f64; r[5] += sums[m][0] / tru; r[6] += (sums[m][0]/tru).powi(2); }
                }
            }}
        }
    }
    for (k, r) in results { println!("{k}: below {:.1}% above {:.1}%, coverage {:.1}%, width {:.2}, n {:.0}, mean {:.3} sd {:.3}", 100.0*r[1]/r[0], 100.0*r[2]/r[0], 100.0-100.0*(r[1]+r[2])/r[0], r[3]/r[0], r[4]/r[0], r[5]/r[0], (r[6]/r[0]-(r[5]/r[0]).powi(2)).sqrt()); }
}
/// Fay-Feuer on total.
fn interval([x, v, w]: [f64;3], kk: f64) -> [f64;2] {
    let x = x.max(0.0); let w = w*kk;
    let lo = if x <= 0.0 { 0.0 } else { v/(2.0*x) * chi2(0.025, 2.0*x*x/v) };
    let (xu, vu) = (x+w, v+w*w);
    let hi = vu/(2.0*xu) * chi2(0.975, 2.0*xu*xu/vu);
    [lo, hi]
}
/// Wilson-Hilferty is poor for small df: bisection on the incomplete gamma.
fn chi2(p: f64, df: f64) -> f64 {
    let (mut lo, mut hi) = (0.0, df + 20.0*(2.0*df).sqrt() + 50.0);
    for _ in 0..100 { let m = 0.5*(lo+hi); if gammp(df/2.0, m/2.0) < p { lo = m } else { hi = m } }
    0.5*(lo+hi)
}
fn gammp(a: f64, x: f64) -> f64 {
    if x <= 0.0 { return 0.0; }
    let g = libm::lgamma(a);
    if x < a+1.0 { let (mut s, mut t, mut n) = (1.0/a, 1.0/a, a); for _ in 0..5000 { n+=1.0; t*=x/n; s+=t; if t< s*1e-12 {break} } s*(-x+a*x.ln()-g).exp() }
    else { let mut b=x+1.0-a; let mut c=1e300; let mut d=1.0/b; let mut h=d; for i in 1..5000 { let an=-(i as f64)*(i as f64-a); b+=2.0; d=an*d+b; if d.abs()<1e-300{d=1e-300} c=b+an/c; if c.abs()<1e-300{c=1e-300} d=1.0/d; let e=d*c; h*=e; if (e-1.0).abs()<1e-12{break} } 1.0-(-x+a*x.ln()-g).exp()*h }
}
