//! Cameras: the file's own, moved by the animations of its node, of the nodes above, and of its lens.

use super::animation::{Animations, Curve, Property};
use super::document::Document;
use super::json::Json;
use super::node::{Nodes, name_of};
use super::place::LARGEST;
use super::uri::shortened;
use crate::error::{Diagnostic, Error, Result, counted};
use crate::import::model::{CameraChoice, FileCamera, ModelOptions};
use crate::import::source::Notes;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::scene::{CameraPath, Easing, FramePose, Pose, Shot, ShotLens};
use std::f64::consts::PI;

/// Most frames that are made of an animation: over an hour at 24 a second.
const MOST_FRAMES: f64 = 100_000.0;
/// Most frames times moving nodes between the camera and the scene.
const MOST_STEPS: f64 = 1e7;
/// Most cameras that an error lists, or that are named in warnings.
const MOST_NAMES: usize = 30;
/// A key this share of a frame after the last one still gets a frame: times are rounded to f32.
const SLACK: f64 = 0.01;

/// A camera that a node of the scene carries.
struct Placed<'d> {
    node: usize,
    /// Number of the camera in the file.
    camera: usize,
    json: Json<'d>,
    node_name: String,
    camera_name: String,
}

/// What a camera says of its lens.
struct FileLens {
    /// Radians.
    vfov: f64,
    /// Width of its image over the height.
    aspect: Option<f64>,
}

/// The camera that `options` name, or the first one whose lens can be rendered, and its move. `None` where there is none.
///
/// Errors: a name that is not there, a camera that is named or the only one and whose lens cannot be rendered, a move of too
/// many frames or out of range.
pub(super) fn read(
    document: &Document<'_>,
    nodes: &Nodes,
    animations: &Animations,
    options: &ModelOptions,
    notes: &mut Notes,
) -> Result<Option<FileCamera>> {
    let all = placed(document, nodes)?;
    let Some(camera) = choose(document, &all, &options.camera, notes)? else { return Ok(None) };
    let FileLens { vfov, aspect } = camera.lens()?;
    note_faulty(&all, camera, notes);
    let rig = Rig::of(camera, nodes, animations);
    let frames = rig.frames(document, options)?;
    note_skewed(camera, &rig.world(frames.start).matrix3, notes);
    let shot = Shot {
        path: rig.path(camera, frames, vfov, options)?,
        easing: Easing::Linear,
        frames: frames.count,
        vfov_degrees: vfov.to_degrees(),
        projections: Vec::new(),
        lens: ShotLens::Pinhole,
    };
    Ok(Some(FileCamera { shot, aspect }))
}

impl Placed<'_> {
    fn is_perspective(&self) -> bool {
        self.json.get("perspective").is_some()
    }

    /// Errors: a lens that cannot be rendered, by the camera's name.
    fn lens(&self) -> Result<FileLens> {
        let name = &self.camera_name;
        let Some(lens) = self.json.get("perspective") else {
            let message = format!("the camera `{name}` is orthographic, which cannot be rendered");
            let help = "give it a perspective in the program that wrote the file, or choose another by --camera";
            return Err(self.json.fault(message).help(help).into());
        };
        lens_of(&lens).map_err(|error| match error {
            Error::Input(fault) => {
                let message = format!("the camera `{name}` cannot be rendered: {}", fault.message);
                Diagnostic { message, ..*fault }.into()
            }
            other => other,
        })
    }
}

fn lens_of(perspective: &Json<'_>) -> Result<FileLens> {
    let vfov = perspective.required("yfov")?;
    let vfov = perspective
        .number("yfov")?
        .filter(|angle| (1e-6..PI).contains(angle))
        .ok_or_else(|| vfov.fault("a vertical field of view lies between 0 and pi, radians"))?;
    let aspect = match perspective.get("aspectRatio") {
        Some(_) => Some(perspective.number_within("aspectRatio", [1e-3, 1e3], 1.0)?),
        None => None,
    };
    Ok(FileLens { vfov, aspect })
}

/// Names the cameras with a perspective, other than the one that is `used`, whose lens cannot be rendered: the first of them.
fn note_faulty(all: &[Placed<'_>], used: &Placed<'_>, notes: &mut Notes) {
    let others = all.iter().filter(|other| other.camera != used.camera && other.is_perspective());
    for error in others.filter_map(|other| other.lens().err()).take(MOST_NAMES) {
        if let Error::Input(fault) = error {
            notes.add(&format!("{}: it is left out", fault.message), None);
        }
    }
}

/// Says that the mirroring or shear of a camera is ignored.
fn note_skewed(camera: &Placed<'_>, axes: &DMat3, notes: &mut Notes) {
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::normalize_or_zero);
    let sheared = [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cos| cos.abs() > 1e-3);
    let what = match x.cross(y).dot(z) {
        volume if volume < -1e-6 => "mirrored",
        _ if sheared => "sheared",
        _ => return,
    };
    let name = &camera.node_name;
    notes.add(&format!("the camera on node `{name}` is {what}, which is ignored"), None);
}

/// All cameras of the scene, in the order of its nodes.
fn placed<'d>(document: &Document<'d>, nodes: &Nodes) -> Result<Vec<Placed<'d>>> {
    let mut all = Vec::new();
    for node in &nodes.shown {
        let json = &document.nodes[*node];
        let Some(camera) = json.index("camera", document.cameras.len(), "camera")? else {
            continue;
        };
        all.push(Placed {
            node: *node,
            camera,
            json: document.cameras[camera].clone(),
            node_name: name_of(json, "node", *node)?,
            camera_name: name_of(&document.cameras[camera], "camera", camera)?,
        });
    }
    Ok(all)
}

fn choose<'p, 'd>(
    document: &Document<'_>,
    all: &'p [Placed<'d>],
    choice: &CameraChoice,
    notes: &mut Notes,
) -> Result<Option<&'p Placed<'d>>> {
    let wanted = match choice {
        CameraChoice::Unwanted => return Ok(None),
        CameraChoice::First => {
            let mut perspective = all.iter().filter(|camera| camera.is_perspective());
            // Where none can be rendered, the first says why.
            let first = perspective.clone().find(|camera| camera.lens().is_ok());
            let first = first.or_else(|| perspective.next());
            if let (None, Some(other)) = (first, all.first()) {
                let name = &other.camera_name;
                notes.add(&format!("the camera `{name}` is orthographic, which cannot be rendered: the model is shown on a turntable"), None);
            }
            note_others(document, all, first, notes)?;
            return Ok(first);
        }
        CameraChoice::Named(wanted) => wanted,
    };
    let by = |name: for<'c> fn(&'c Placed<'d>) -> &'c str| {
        all.iter().find(|camera| name(camera) == wanted)
    };
    let by_number = || wanted.parse::<usize>().ok().and_then(|at| all.get(at));
    let found = by(|c| &c.node_name).or_else(|| by(|c| &c.camera_name)).or_else(by_number);
    if found.is_some() {
        return Ok(found);
    }
    let message = format!("the scene has no camera `{}`", shortened(wanted));
    let help = match all.len() {
        0 => "it has none: leave out --camera, and the camera orbits the model".into(),
        more if more > MOST_NAMES => format!("its first cameras are {}", names(all)),
        _ => format!("its cameras are {}", names(all)),
    };
    Err(Diagnostic::new(document.file, message).help(help).into())
}

/// The first cameras, each as `--camera` takes it.
fn names(all: &[Placed<'_>]) -> String {
    let name = |(at, camera): (usize, &Placed<'_>)| {
        format!("{at}: `{}` on node `{}`", camera.camera_name, camera.node_name)
    };
    let names: Vec<String> = all.iter().enumerate().take(MOST_NAMES).map(name).collect();
    names.join(", ")
}

/// Names the cameras that are not `used`, where nobody has chosen one.
fn note_others(
    document: &Document<'_>,
    all: &[Placed<'_>],
    used: Option<&Placed<'_>>,
    notes: &mut Notes,
) -> Result<()> {
    let first = if all.len() > MOST_NAMES { "the first of them are" } else { "they are" };
    match used {
        Some(used) if all.len() > 1 => {
            let (own, count, names) = (&used.camera_name, all.len(), names(all));
            let what = format!(
                "the camera is `{own}`; --camera takes another of the {count}, {first} {names}"
            );
            notes.add(&what, None);
        }
        None if all.is_empty() && !document.cameras.is_empty() => {
            let name = name_of(&document.cameras[0], "camera", 0)?;
            let what = format!("the camera `{name}` is on no node of the scene that is shown");
            notes.add(&what, None);
        }
        _ => {}
    }
    Ok(())
}

/// What moves a camera.
struct Rig<'a> {
    /// Nodes from the camera's own up: animated ones, and what still ones between them add up to.
    links: Vec<Link>,
    nodes: &'a Nodes,
    animations: &'a Animations,
    lens: Option<&'a Curve>,
    /// Times of the first and the last key, seconds; `None` of a still camera.
    span: Option<[f64; 2]>,
}

enum Link {
    Still(DAffine3),
    Animated(usize),
}

/// The frames of a move.
#[derive(Debug, Clone, Copy)]
struct FrameTimes {
    start: f64,
    fps: f64,
    count: u32,
}

impl<'a> Rig<'a> {
    fn of(camera: &Placed<'_>, nodes: &'a Nodes, animations: &'a Animations) -> Self {
        let lens = animations.get(Property::Yfov(camera.camera));
        let mut links = Vec::new();
        let mut span: Option<[f64; 2]> = lens.map(Curve::span);
        for node in nodes.chain(camera.node) {
            if animations.moves(node) {
                links.push(Link::Animated(node));
                for [first, last] in animations.of_node(node).map(Curve::span) {
                    span = Some(span.map_or([first, last], |[a, b]| [a.min(first), b.max(last)]));
                }
                continue;
            }
            let local = nodes.local(node, animations, 0.0);
            match links.last_mut() {
                Some(Link::Still(below)) => *below = local * *below,
                _ => links.push(Link::Still(local)),
            }
        }
        Self { links, nodes, animations, lens, span }
    }

    /// The frames from the first key to the last.
    fn frames(&self, document: &Document<'_>, options: &ModelOptions) -> Result<FrameTimes> {
        let fps = options.fps;
        let Some([start, end]) = self.span else {
            return Ok(FrameTimes { start: options.time, fps, count: 1 });
        };
        let count = ((end - start) * fps + SLACK).floor() + 1.0;
        if count > MOST_FRAMES || count * self.links.len() as f64 > MOST_STEPS {
            let message = format!(
                "the camera's animation has {count:.0} frames at {fps} a second; {MOST_FRAMES} can be rendered"
            );
            let help = "choose fewer frames a second with --fps, or shorten the animation";
            return Err(Diagnostic::new(document.file, message).help(help).into());
        }
        Ok(FrameTimes { start, fps, count: count as u32 })
    }

    /// The path of the camera.
    ///
    /// Errors: a place that is not a finite number, a view without a direction, a lens out of range.
    fn path(
        &self,
        camera: &Placed<'_>,
        frames: FrameTimes,
        vfov: f64,
        options: &ModelOptions,
    ) -> Result<CameraPath> {
        if self.span.is_none() {
            return Ok(CameraPath::Still(pose(camera, &self.world(options.time))?));
        }
        let frame = |number: u32| {
            let time = frames.start + f64::from(number) / frames.fps;
            let vfov = self.lens.map_or(vfov, |lens| lens.at(time)[0]);
            if !(1e-6..PI - 1e-6).contains(&vfov) {
                let number = number + 1;
                return Err(camera.json.fault(format!("in frame {number} the vertical field of view is {vfov}; it lies between 0 and pi, radians")).into());
            }
            Ok(FramePose {
                pose: pose(camera, &self.world(time))?,
                vfov_degrees: vfov.to_degrees(),
            })
        };
        (0..frames.count).map(frame).collect::<Result<_>>().map(CameraPath::Frames)
    }

    /// The camera's place in the world.
    fn world(&self, time: f64) -> DAffine3 {
        self.links.iter().fold(DAffine3::IDENTITY, |below, link| match link {
            Link::Still(place) => *place * below,
            Link::Animated(node) => self.nodes.local(*node, self.animations, time) * below,
        })
    }
}

/// The pose of a camera, which looks along -z with y up.
fn pose(camera: &Placed<'_>, world: &DAffine3) -> Result<Pose> {
    let (eye, up) = (world.translation, world.matrix3.y_axis.normalize_or_zero());
    let forward = (-world.matrix3.z_axis).normalize_or_zero();
    let is_there = eye.is_finite() && eye.abs().max_element() <= LARGEST;
    if !is_there || forward == DVec3::ZERO || up.cross(forward).length() < 1e-9 {
        let name = &camera.node_name;
        return Err(camera
            .json
            .fault(format!("on node `{name}` the camera has no place or direction"))
            .into());
    }
    // Far from the origin a target nearby would be rounded into another direction.
    let reach = eye.abs().max_element().max(1.0);
    Ok(Pose { eye, target: eye + forward * reach, up, roll_degrees: 0.0 })
}

/// What the scene says of nodes that move and are not the camera's.
pub(super) fn note_moving(
    document: &Document<'_>,
    nodes: &Nodes,
    animations: &Animations,
    time: f64,
    notes: &mut Notes,
) -> Result<()> {
    let mut is_moved = vec![false; document.nodes.len()];
    let mut moving = 0;
    let mut bends = Vec::with_capacity(document.skins.len());
    for skin in &document.skins {
        let mut joints = skin.list("joints")?.into_iter();
        bends.push(joints.any(|joint| joint.as_whole().is_ok_and(|node| animations.moves(node))));
    }
    // Parents come first.
    for at in &nodes.shown {
        let json = &document.nodes[*at];
        let above = nodes.chain(*at).nth(1).is_some_and(|parent| is_moved[parent]);
        is_moved[*at] = above || animations.moves(*at);
        let morphs = animations.get(Property::Weights(*at)).is_some();
        let shows = json.get("mesh").is_some() || json.extension("KHR_lights_punctual").is_some();
        let skin = json.index("skin", bends.len(), "skin")?;
        let bends = skin.is_some_and(|at| bends[at]);
        moving += usize::from(shows && (is_moved[*at] || morphs || bends));
    }
    if moving > 0 {
        let nodes = counted(moving, "node");
        let within = match animations.span() {
            Some([first, last]) if !(first..=last).contains(&time) && time != 0.0 => {
                format!("; the file's animations last from {first} to {last} s")
            }
            _ => String::new(),
        };
        notes.add(&format!("the scene is static: meshes and lights of {nodes} are animated, and stay as they are at {time} s (--time){within}"), None);
    } else if time != 0.0 {
        notes.add(
            &format!("{time} s (--time) changes nothing: no mesh and no light is animated"),
            None,
        );
    }
    Ok(())
}
