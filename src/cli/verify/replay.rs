//! One ray of `verify` again, with all details.

use super::VerifyArgs;
use super::report::meaning;
use crate::cli::exit::Exit;
use crate::cli::say;
use crate::error::{Error, Result};
use crate::intersect::{CourtHit, Hit, Intersector, PrimRef};
use crate::math::DVec3;
use crate::verify::{Answers, Check, Class, RayId, Replay};
use serde::Serialize;

/// Hits along the ray that are printed.
const MOST_HITS: usize = 8;

/// The JSON document about the ray; the text has the same content.
#[derive(Serialize)]
struct Report {
    ray: RayId,
    /// `org`, `dir` and ends, scene space; and origin and direction in the world.
    org: [f64; 3],
    dir: [f64; 3],
    tnear: f64,
    /// `null` for a ray without an end.
    tfar: Option<f64>,
    excluded: Option<String>,
    world_org: [f64; 3],
    product: Answer,
    oracle: Answer,
    /// What the ray hits by the exact court, nearest first.
    along: Vec<Answer>,
    class: Option<Class>,
    explained: bool,
    ulps: Option<f64>,
}

#[derive(Serialize, Default)]
struct Answer {
    /// Source of the answer: an intersector's name, or the court.
    by: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    occluded: Option<bool>,
    /// The hit; `None` for a miss.
    hit: Option<Place>,
}

#[derive(Serialize)]
struct Place {
    what: String,
    t: f64,
    u: f64,
    v: f64,
    /// Scene space.
    point: [f64; 3],
    world_point: [f64; 3],
    /// Corners of the triangle, scene space.
    corners: Option<[[f64; 3]; 3]>,
    /// Distance of the ray from the triangle and from its nearest edge, in ulp.
    off_ulps: Option<f64>,
    edge_ulps: Option<f64>,
}

/// Traces and prints the ray.
pub fn run(args: &VerifyArgs, check: &Check, id: RayId) -> Result<Exit> {
    let Some(replay) = check.replay(id) else {
        return Err(Error::Usage(format!(
            "there is no ray {id} in this scene: nothing to start from or to aim at"
        )));
    };
    let report = Report::new(check, id, &replay);
    if args.json {
        say::json(&report)?;
    } else {
        say::text(&report.to_text())?;
    }
    Ok(if report.explained { Exit::Done } else { Exit::Failed })
}

impl Report {
    fn new(check: &Check, id: RayId, replay: &Replay) -> Self {
        let ray = replay.trial.ray;
        let names = [check.product.describe(), check.oracle.describe()];
        let [product, oracle] = match replay.trial.answers {
            Answers::Hits { product, oracle } => [product, oracle].map(|hit| (None, hit)),
            Answers::Occlusion { product, oracle } => {
                [product, oracle].map(|occluded| (Some(occluded), None))
            }
        };
        let [product_name, oracle_name] = names;
        let answer = |by, (occluded, hit): (Option<bool>, Option<Hit>)| Answer {
            by,
            occluded,
            hit: hit.map(|hit| Place::new(check, replay, &hit)),
        };
        let along = replay.all_hits.iter().take(MOST_HITS).map(|CourtHit { hit, place }| {
            answer(format!("court, {place:?}").to_lowercase(), (None, Some(*hit)))
        });
        Self {
            ray: id,
            org: ray.org.to_array(),
            dir: ray.dir.to_array(),
            tnear: ray.tnear,
            tfar: ray.tfar.is_finite().then_some(ray.tfar),
            excluded: (ray.exclude != PrimRef::NONE).then(|| name(check, ray.exclude)),
            world_org: check.scene.recentring.point_to_world(ray.org).to_array(),
            product: answer(product_name, product),
            oracle: answer(oracle_name, oracle),
            along: along.collect(),
            class: replay.difference.map(|d| d.class),
            explained: replay.difference.is_none_or(|d| d.class.is_explained()),
            ulps: replay.difference.map(|d| d.ulps),
        }
    }

    fn to_text(&self) -> String {
        let tfar = self.tfar.map_or("without end".into(), |t| format!("to t {t:?}"));
        let mut lines = vec![
            format!("ray {}", self.ray),
            format!("  from {}  (world {})", numbers(self.org), numbers(self.world_org)),
            format!("  along {}, from t {:?} {tfar}", numbers(self.dir), self.tnear),
        ];
        lines.extend(self.excluded.iter().map(|what| format!("  it leaves {what}")));
        for answer in [&self.product, &self.oracle].into_iter().chain(&self.along) {
            lines.push(answer.to_text());
        }
        lines.push(match (self.class, self.ulps) {
            (Some(class), Some(ulps)) => {
                let word = if self.explained { "explained" } else { "UNEXPLAINED" };
                format!("{word}: {} ({ulps:.3} ulp)", meaning(class))
            }
            _ => "no difference".into(),
        });
        lines.join("\n") + "\n"
    }
}

impl Answer {
    fn to_text(&self) -> String {
        let by = &self.by;
        match (&self.hit, self.occluded) {
            (_, Some(occluded)) => format!("{by}: {}", if occluded { "occluded" } else { "open" }),
            (None, None) => format!("{by}: nothing"),
            (Some(p), None) => {
                let mut text = format!(
                    "{by}: {} at t {:?}, u {:?}, v {:?}\n  point {}  (world {})",
                    p.what,
                    p.t,
                    p.u,
                    p.v,
                    numbers(p.point),
                    numbers(p.world_point)
                );
                if let (Some([a, b, c]), Some(off), Some(edge)) =
                    (p.corners, p.off_ulps, p.edge_ulps)
                {
                    text += &format!(
                        "\n  corners {}, {}, {}\n  the ray passes {off:.3} ulp from the triangle, \
                         {edge:.3} from its nearest edge",
                        numbers(a),
                        numbers(b),
                        numbers(c)
                    );
                }
                text
            }
        }
    }
}

impl Place {
    fn new(check: &Check, replay: &Replay, hit: &Hit) -> Self {
        let ray = &replay.trial.ray;
        let point = ray.at(hit.t);
        let corners = check.oracle.corners(hit.prim);
        let line = check.oracle.line(ray);
        Self {
            what: name(check, hit.prim),
            t: hit.t,
            u: hit.u,
            v: hit.v,
            point: point.to_array(),
            world_point: check.scene.recentring.point_to_world(point).to_array(),
            corners: corners.map(|c| c.map(|p: DVec3| p.to_array())),
            off_ulps: corners.map(|c| line.ulps(&c)),
            edge_ulps: corners.map(|c| line.edge_ulps(&c)),
        }
    }
}

fn name(check: &Check, prim: PrimRef) -> String {
    let PrimRef { geom_id, prim_id } = prim;
    match check.scene.meshes.get(geom_id as usize) {
        Some(mesh) => format!("triangle {prim_id} of mesh {geom_id} ({})", mesh.name),
        None => format!("sphere {prim_id} ({})", check.scene.spheres[prim_id as usize].name),
    }
}

fn numbers(v: [f64; 3]) -> String {
    format!("({:?}, {:?}, {:?})", v[0], v[1], v[2])
}
