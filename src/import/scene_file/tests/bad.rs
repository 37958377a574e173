//! Bad files: each with its place, marked by `¦`, and a part of message or help.

use super::*;

/// Text with `¦` before the place, part of the message, part of the help ("" for any).
type Case = (&'static str, &'static str, &'static str);

const NAMES: &[Case] = &[
    ("[¦lights]\n", "unknown key `lights`", "did you mean `light`?"),
    ("¦camra = 1\n", "unknown key `camra`", "`camera`"),
    ("¦xyzzy = 1\n", "unknown key `xyzzy`", "valid here: `camera`, `light`"),
    ("[camera]\nfov = 40\n¦frams = 3\n", "unknown key `frams`", "`frames`"),
    ("[camera.pan]\nfrom = [1, 0, 0]\n¦form = [1, 0, 0]\n", "unknown key `form`", "`from`"),
    ("[[mesh]]\nbox = { min = [0, 0, 0], ¦maxi = [1, 1, 1] }\n", "`maxi`", "`max`"),
    ("[[light]]\n[light.point]\n¦possition = [0, 0, 0]\n", "`possition`", "`position`"),
    ("light = [{ spot = { ¦radiance = 1 } }]\n", "`radiance`", "did you mean `intensity`?"),
    ("light = [{ point = { ¦irradiance = 1 } }]\n", "`irradiance`", "did you mean `intensity`?"),
    ("light = [{ disk = { ¦intensity = 1 } }]\n", "`intensity`", "did you mean `radiance`?"),
    ("light = [{ directional = { ¦Intensity = 1 } }]\n", "`Intensity`", "`irradiance`"),
    ("[[light]]\n¦pont = { position = [0, 0, 0] }\n", "unknown key `pont`", "`point`"),
    ("[material.red]\n¦difuse = 1\n", "unknown key `difuse`", "`diffuse`"),
    ("[material.a]\nglass = { ¦iro = 1.5 }\n", "unknown key `iro`", "`ior`"),
    ("[material.a]\nprincipled = { ¦metalic = 1 }\n", "unknown key `metalic`", "`metallic`"),
    ("[material.a]\nmirror = 1\nprincipled = ¦{ metallic = 1 }\n", "`mirror`", "`base_colour`"),
    ("[material.a]\nglass = {}\nprincipled = ¦{}\n", "`glass`", ""),
    ("[material.a]\nprincipled = { metallic = ¦2 }\n", "from 0 to 1", ""),
    ("[material.a]\nprincipled = { transmission = ¦2 }\n", "from 0 to 1", ""),
    ("[material.a]\nprincipled = ¦{ thin = true }\n", "need a `transmission` above 0", ""),
    (
        "[material.a]\nprincipled = ¦{ transmission = 1, thin = true, absorption = 1 }\n",
        "no inside",
        "",
    ),
    ("[material.a]\nprincipled = { base_colour = [1, ¦2, 0] }\n", "from 0 to 1", ""),
    ("[settings]\n¦sspp = 4\n", "unknown key `sspp`", "`spp`"),
    ("[settings.rules]\n¦retri = true\n", "unknown key `retri`", "`retry`"),
    ("[reuse]\n¦tolerence = 1\n", "unknown key `tolerence`", "`tolerance`"),
    ("[reuse]\npolicy = ¦'surfaces'\n", "unknown value `surfaces`", "`surface`"),
    ("[[reuse.traced]]\nmin = [0, 0, 0]\n¦mx = [1, 1, 1]\n", "unknown key `mx`", "`max`"),
    ("[settings]\nfilter = ¦\"bocks\"\n", "unknown value `bocks`", "valid here: `box`"),
    ("[settings]\nisa = ¦'avx3'\n", "unknown value `avx3`", "`avx"),
    ("[camera]\neasing = ¦'inout'\n", "unknown value `inout`", "`in-out`"),
    ("[camera]\nup = ¦'w'\n", "unknown value `w`", "`x`"),
    (
        "[[mesh]]\ntransform = [{ scale = 2 }, { ¦rotat = { axis = 'y', degrees = 3 } }]\n",
        "`rotat`",
        "`rotate`",
    ),
    (
        "[material.red]\n[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = ¦'rde'\n",
        "unknown material `rde`",
        "`red`",
    ),
    (
        "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = ¦'red'\n",
        "unknown material `red`",
        "[material.red]",
    ),
    ("[camera]\nlens = { radius = 1, focus = ¦'far' }\n", "\"far\"", ""),
    ("[camera]\nlens = { radius = 1, focus = ¦0 }\n", "found 0", ""),
    ("[camera]\nlens = { radius = ¦-1 }\n", "found -1", ""),
    ("[camera]\nlens = ¦{ focus = 2 }\n", "no aperture", "`f_number`"),
    ("[camera]\nlens = { radius = 1, f_number = ¦2 }\n", "`radius`", "not both"),
    ("[camera]\nlens = { radius = 1, sensor_height = ¦2 }\n", "no effect", ""),
    ("[camera]\nlens = { radius = 1, blades = ¦2 }\n", "found 2", ""),
    ("[camera]\nlens = { radius = 1, blade_rotation = ¦2 }\n", "no effect", "round"),
    (
        "[camera]\nkeys = [\n{ eye = [0, 0, 1], target = [0, 0, 0], lens = { radius = 1 } },\n\
         ¦{ eye = [0, 0, 2], target = [0, 0, 0] }]\n",
        "no aperture",
        "`radius`",
    ),
    ("[material.a]\nglass = { thin = true, absorption = ¦0.5 }\n", "`absorption`", ""),
    ("[material.a]\nglass = { priority = ¦1, thin = true }\n", "`priority`", ""),
    ("[material.a]\nglass = { priority = ¦1, roughness = 0.2 }\n", "`priority`", ""),
    ("[material.a]\nglass = { roughness = ¦1.5 }\n", "1.5", ""),
    (
        "[camera]\nlens = { radius = 1, f_number = ¦2 }\n\
         keys = [{ eye = [0, 0, 1], target = [0, 0, 0], lens = { radius = 1 } }]\n",
        "`radius`",
        "not both",
    ),
    ("¦[[sphere]]\nradius = 1\n", "the key `centre` is missing", ""),
    ("[camera]\npan = ¦{ from = [0, 0, 1], to = [0, 0, 2] }\n", "the key `target` is missing", ""),
];

/// TOML has no number that begins or ends with its point.
const POINTS: &[&str] = &[
    "[camera]\nfov = .7\n|write 0.7",
    "[camera]\nfov = -.7\n|write -0.7",
    "[camera]\nfov = 7.\n|write 7.0",
    "[camera]\nfov = .5e1 # a remark\n|write 0.5e1",
    "[material.a]\ndiffuse = [.7, 0.2, 0.3]\n|write 0.7",
    "[material.a]\ndiffuse = [0.1,.2, 0.3]\n|write 0.2",
    "[material.a]\ndiffuse = [0.1, 0.2, 3.]\n|write 3.0",
    "[material.a]\nglass = { ior = .5 }\n|write 0.5",
];

#[test]
fn a_number_without_a_digit_beside_its_point_is_told_how_to_be_written() {
    for case in POINTS {
        let (text, help) = case.split_once('|').expect("a case");
        let source = Source { path: "s.toml".into(), text: text.into() };
        let told = SceneFile::parse(&source).expect_err(text).to_string();
        assert!(told.contains("a digit on both sides"), "{text}: {told}");
        assert!(told.ends_with(help), "{text}: {told}");
    }
    for text in
        ["a..b = 1\n", "[camera]\nfov = 1.2.3\n", "[camera]\nfov = '.7'\n", "[camera]\nfov = .\n"]
    {
        let source = Source { path: "s.toml".into(), text: text.into() };
        let told = SceneFile::parse(&source).expect_err(text).to_string();
        assert!(!told.contains("a digit on both sides"), "{text}: {told}");
    }
}

const TYPES: &[Case] = &[
    ("camera = ¦3\n", "expected a table, found integer `3`", ""),
    (
        "[camera]\nfov = ¦'wide'\n",
        "expected an angle in degrees above 0 and below 180, found string \"wide\"",
        "",
    ),
    (
        "[camera.still]\neye = ¦[1, 2]\ntarget = [0, 0, 0]\n",
        "expected an array of 3 values, found 2",
        "",
    ),
    (
        "[camera.still]\neye = ¦[1, 2, 3, 4]\ntarget = [0, 0, 0]\n",
        "expected an array of 3 values, found 4",
        "",
    ),
    ("[camera.still]\neye = [1, ¦'2', 3]\ntarget = [0, 0, 0]\n", "found string \"2\"", ""),
    ("[sky]\nlights = ¦1\n", "expected a boolean, found integer `1`", ""),
    (
        "[settings]\nspp = ¦4.0\n",
        "from 1 to 65536, or the least and the most, as in [4, 16], found floating point `4.0`",
        "",
    ),
    ("[settings]\ntime_limit = ¦'25x'\n", "a time limit is written with its units, as in 90s", ""),
    ("[settings]\ntime_limit = ¦25\n", "found integer `25`", ""),
    ("[settings]\ncheckpoint = ¦'never'\n", "as in 90s, 25m or 1h30m, or off", ""),
    ("[settings]\nfps = ¦2000-01-01\n", "found a table or a date", ""),
    ("[settings]\nsize = ¦640\n", "expected an array of 2 values, found integer `640`", ""),
    ("[settings]\nseed = ¦99999999999999999999\n", "expected a whole number from 0", ""),
    (
        "[sky]\nradiance = ¦true\n",
        "expected a number or an array of 3 numbers, found boolean `true`",
        "",
    ),
    ("[settings]\nglass_shadows = ¦true\n", "expected \"opaque\" or \"straight\"", ""),
    ("[settings]\nglass_shadows = ¦{}\n", "expected \"opaque\" or \"straight\"", ""),
    (
        "[settings]\nfilter = ¦[1, 2]\nseed = 3\n",
        "expected \"box\", \"tent\", \"gaussian\" or \"blackman-harris\"",
        "",
    ),
    ("[settings]\nrules = { recheck = ¦1 }\n", "expected \"", ""),
    ("[camera]\neasing = ¦1\n", "expected \"linear\", \"in\", \"out\" or \"in-out\"", ""),
    ("[[mesh]]\nfile = 'a.ply'\nup = ¦2\n", "expected \"x\", \"y\" or \"z\"", ""),
    ("[camera]\nlens = { radius = 1, focus = ¦true }\n", "or \"target\", found boolean", ""),
    ("[camera]\nposes = ¦3\n", "expected a file name or a table, found integer `3`", ""),
    ("[material.a]\ntexture = ¦3\n", "expected a file name or a table, found integer `3`", ""),
    (
        "[material.a]\nmirror = 1\nroughness = ¦true\n",
        "expected a number from 0 to 1, a file name or a table, found boolean `true`",
        "",
    ),
    ("light = [¦3]\n", "expected a table", ""),
    ("[[mesh]]\ntransform = [¦3]\n", "expected a table", ""),
    ("¦[[light]]\n", "exactly one key that says the kind", "`point`, `directional`"),
    (
        "¦[[light]]\npoint = { position = [0, 0, 0], intensity = 1 }\nsphere = { centre = [0, 0, 0], radius = 1, radiance = 1 }\n",
        "exactly one key that says the kind",
        "`point`, `directional`",
    ),
    (
        "[[mesh]]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\ntransform = ¦{ scale = 2 }\n",
        "expected an array, found a table",
        "",
    ),
];

/// Names of files that are empty.
const UNNAMED: &[Case] = &[
    ("[material.a]\ntexture = ¦''\n", "the name of the file is empty", ""),
    ("[material.a]\ntexture = { file = ¦'', scale = 2 }\n", "the name of the file is empty", ""),
    ("[material.a]\nmirror = 1\nroughness = ¦''\n", "the name of the file is empty", ""),
    (
        "[material.a]\nprincipled = { metallic = { file = ¦'' } }\n",
        "the name of the file is empty",
        "",
    ),
    ("[sky]\nimage = ¦''\n", "the name of the file is empty", ""),
    ("[[mesh]]\nfile = ¦''\n", "the name of the file is empty", ""),
    ("[camera]\nposes = ¦''\n", "the name of the file is empty", ""),
    ("[camera]\nposes = { file = ¦'' }\n", "the name of the file is empty", ""),
];

const RANGES: &[Case] = &[
    ("[camera]\nfov = ¦180\n", "expected an angle in degrees above 0 and below 180, found 180", ""),
    ("[camera]\nfov = ¦0.0\n", "found 0.0", ""),
    ("[camera]\nfov = ¦nan\n", "found NaN", ""),
    ("[camera]\nshift = [0, ¦2000]\n", "expected a number from -1000 to 1000, found 2000", ""),
    ("[camera]\nshift = ¦[0]\n", "expected an array of 2 values", ""),
    ("[camera]\npixel_aspect = ¦0\n", "expected a number from 0.001 to 1000, found 0", ""),
    (
        "[camera]\nkeys = [{ eye = [0, 0, 1], target = [0, 0, 0], fov = ¦0 }]\n",
        "above 0 and below 180",
        "",
    ),
    ("[camera]\nframes = ¦0\n", "expected a whole number from 1 to 1000000, found 0", ""),
    ("[camera]\nup = ¦[0, 0, 0]\n", "a direction cannot be [0, 0, 0]", ""),
    (
        "[camera.still]\neye = [1, ¦inf, 3]\ntarget = [0, 0, 0]\n",
        "expected a number from -1e30 to 1e30, found inf",
        "",
    ),
    (
        "[[sphere]]\ncentre = [0, 0, 0]\nradius = ¦-1\n",
        "expected a number from 1e-30 to 1e30, found -1",
        "",
    ),
    (
        "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n[[sphere]]\ncentre = [0, 0, 0]\nradius = ¦0\n",
        "found 0",
        "",
    ),
    (
        "[[light]]\nsphere = { centre = [0, 0, 0], radius = ¦-2.5, radiance = 1 }\n",
        "found -2.5",
        "",
    ),
    (
        "[[light]]\npoint = { position = [0, 0, 0], intensity = [1, ¦-1, 1] }\n",
        "expected a number from 0 to 1e30, found -1",
        "",
    ),
    (
        "[[light]]\nquad = { centre = [0, 0, 0], normal = ¦[0, 0, 0], size = [1, 1], radiance = 1 }\n",
        "a direction cannot be",
        "",
    ),
    ("[material.red]\ndiffuse = [0.5, ¦1.5, 0]\n", "expected a number from 0 to 1, found 1.5", ""),
    ("[material.red]\ndiffuse = ¦-0.1\n", "expected a number from 0 to 1, found -0.1", ""),
    (
        "[material.a]\nglass = { ior = ¦0 }\n",
        "expected an index of refraction from 0.1 to 10, found 0",
        "",
    ),
    ("[reuse]\nsegment = ¦0\n", "expected a whole number from 1 to 1000000, found 0", ""),
    ("[reuse]\ntolerance = ¦-1\n", "expected a number from 0 to 255, found -1", ""),
    ("[reuse]\nprobes = ¦1.5\n", "expected a number from 0 to 1, found 1.5", ""),
    ("[reuse]\ntolerance = ¦256\n", "expected a number from 0 to 255, found 256", ""),
    ("[reuse]\ncolour_epsilon = ¦nan\n", "expected a number from 0 to 1e30, found NaN", ""),
    ("[settings]\nspp = ¦[8, 2]\n", "the least and the most samples, found [8, 2]", ""),
    ("[settings]\nshadow_samples = ¦[8, 2]\n", "the least and the most samples, found [8, 2]", ""),
    ("[settings]\naovs = ¦['dept']\n", "unknown value `dept`", "did you mean `depth`?"),
    ("[settings]\nspp = ¦0\n", "expected a whole number from 1 to 65536, found 0", ""),
    ("[settings]\nsize = [640, ¦0]\n", "expected a whole number from 1 to 32768, found 0", ""),
    ("[settings]\npng_bits = ¦12\n", "expected 8 or 16, found 12", ""),
    ("[settings]\ncutoff = ¦2\n", "expected a number from 0 to 1, found 2", ""),
    (
        "[[mesh]]\nterrain = { vertices = ¦1 }\n",
        "expected a whole number from 2 to 65535, found 1",
        "",
    ),
    (
        "[[mesh]]\nterrain = ¦{ vertices = 65535 }\n",
        "would have 8589410312 triangles",
        "at most 100000000",
    ),
    ("[[mesh]]\nterrain = { vertices = ¦1000000 }\n", "expected a whole number from 2", ""),
    ("[[mesh]]\nterrain = {}\ntransform = [{ scale = ¦0 }]\n", "found 0", ""),
];

const TOGETHER: &[Case] = &[
    (
        "[material.a]\ndiffuse = 0.5\nmirror = ¦[0.5, 0.6, 0.2]\n",
        "together reflect 1.1 of green light",
        "",
    ),
    ("[material.a]\ndiffuse = 0.5\nglass = ¦{ ior = 1.5 }\n", "glass stands alone", ""),
    ("[material.a]\ndiffuse = 0.5\nroughness = ¦0.2\n", "needs `mirror`", ""),
    (
        "[camera]\npan = { from = [0, 0, 1], to = [0, 0, 2], target = [0, 0, 0] }\norbit = ¦{}\n",
        "has a path already: `pan`",
        "`orbit`",
    ),
    ("[camera]\nstill = ¦{ eye = [1, 2, 3], target = [1, 2, 3] }\n", "own target", ""),
    ("[camera]\norbit = ¦{ eye = [0, 5, 0], target = [0, 0, 0] }\n", "axis", ""),
    (
        "[camera]\nbspline = ¦{ points = [[0, 0, 1], [0, 0, 2], [0, 0, 3]], target = [0, 0, 0] }\n",
        "at least 4",
        "",
    ),
    (
        "[camera]\n[[camera.keys]]\nat = 0.5\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n[[camera.keys]]\nat = ¦0.5\neye = [0, 0, 2]\ntarget = [0, 0, 0]\n",
        "not later than",
        "",
    ),
    (
        "[camera]\nkeys = [{ at = 0, eye = [0, 0, 1], target = [0, 0, 0] }, ¦{ eye = [0, 0, 2], target = [0, 0, 0] }]\n",
        "no `at`",
        "for every key",
    ),
    (
        "[[camera.keys]]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n¦[[camera.keys]]\neye = [0, 0, 2]\ntarget = [0, 0, 2]\n",
        "own target",
        "",
    ),
    (
        "¦[[light]]\nspot = { position = [0, 5, 0], intensity = 1 }\n",
        "a spot is aimed by either `direction` or `target`",
        "",
    ),
    (
        "¦[[light]]\nspot = { position = [0, 5, 0], target = [0, 5, 0], intensity = 1 }\n",
        "the spot's target is its own position",
        "",
    ),
    (
        "¦[[light]]\nspot = { position = [0, 5, 0], direction = 'x', intensity = 1, inner_angle = 50 }\n",
        "`inner_angle`, 50, is beyond its `outer_angle`, 45",
        "",
    ),
    (
        "¦[[light]]\nspot = { position = [0, 5, 0], direction = 'x', intensity = 1, outer_angle = 0 }\n",
        "it sends no light",
        "",
    ),
    (
        "¦[[light]]\nquad = { centre = [0, 0, 0], radiance = 1 }\n",
        "by `corner` and `edges`, or",
        "one form",
    ),
    ("[[mesh]]\nquad = ¦{ corner = [0, 0, 0], edges = [[1, 0, 0], [2, 0, 0]] }\n", "parallel", ""),
    ("[[mesh]]\nbox = ¦{ min = [0, 0, 0], max = [1, 0, 1] }\n", "`min` must be smaller", ""),
    ("¦[[mesh]]\nname = 'nothing'\n", "no triangles", "exactly one of"),
    ("[[mesh]]\nterrain = {}\nquad = ¦{}\n", "elsewhere already", "exactly one of"),
    ("[[mesh]]\nterrain = {}\nup = ¦'z'\n", "`up` is for mesh files", ""),
    ("[[mesh]]\nfile = ¦'meshes/bunny.obj'\n", "cannot read", ""),
    ("[[mesh]]\nfile = ¦'scene.tml'\n", "cannot read", "did you mean `scene.toml`?"),
    ("[[mesh]]\nfile = ¦'scene.toml'\n", "no mesh format", ".ply"),
    ("[material.a]\ntexture = ¦'wood.png'\n", "cannot read", ""),
    ("[material.a]\ntexture = ¦{ file = 'wood.png' }\n", "cannot read", ""),
    ("[material.a]\ntexture = { file = 'a', ¦wrp = 'clamp' }\n", "unknown key `wrp`", "`wrap`"),
    ("[material.a]\ntexture = { file = 'a', wrap = ¦'tile' }\n", "unknown value `tile`", ""),
    ("[material.a]\ntexture = { file = 'a', scale = [1, ¦0] }\n", "found 0", ""),
    ("[material.a]\nalpha = ¦'leaf.png'\n", "cannot read", ""),
    ("[material.a]\nalpha = ¦0.5\n", "a file name or a table", ""),
    (
        "[[mesh]]\nterrain = {}\ntransform = [¦{ matrix = [[1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0]] }]\n",
        "flattens",
        "",
    ),
    ("[settings]\nsize = [10, 10]\ncrop = ¦[0, 0, 11, 5]\n", "leaves the image", "x0 < x1"),
    ("¦[[reuse.traced]]\nmin = [0, 0, 0]\nmax = [1, 0, 1]\n", "`min` must be smaller", ""),
    ("[settings]\nframes = ¦[3, 2]\n", "comes after", ""),
    ("[settings]\nframes = ¦[1, 17]\n[camera]\nframes = 16\n", "no frame 17", ""),
    ("[settings]\noutput = ¦''\n", "empty", ""),
];

const SKIES: &[Case] = &[
    ("[sky]\nradiance = 1\ngradient = ¦{ zenith = 1, horizon = 1, ground = 1 }\n", "one of", ""),
    (
        "[sky]\nsun_sky = { to_sun = 'y' }\nimage = ¦'none.exr'\n",
        "one of `radiance`, `image`, `gradient` and `sun_sky`",
        "",
    ),
    ("[sky]\nradiance = 1\nrotate = ¦90\n", "`rotate` belongs to", "`radiance`"),
    ("[sky]\nstrength = ¦2\n", "`strength` belongs to", ""),
    ("[sky]\nimage = 'none.exr'\nstrength = ¦0\n", "found 0", ""),
    ("[sky]\nimage = 'none.exr'\nrotate = ¦1e9\n", "from -1e6 to 1e6", ""),
    ("[sky]\nimage = ¦'none.exr'\n", "none.exr", ""),
    ("[sky]\nimage = ¦'scene.toml'\n", "not a readable image", ""),
    ("[sky]\n¦img = 'none.exr'\n", "unknown key `img`", "`image`"),
    ("[sky]\ngradient = ¦{ zenith = 1, horizon = 1 }\n", "the key `ground` is missing", ""),
    ("[sky]\ngradient = ¦{ zenith = 0, horizon = 0, ground = 0 }\n", "black", ""),
    ("[sky]\ngradient = { zenith = ¦-1, horizon = 0, ground = 0 }\n", "found -1", ""),
    ("[sky]\nsun_sky = ¦{ to_sun = [1, -0.1, 0] }\n", "below the horizon", ""),
    ("[sky]\nsun_sky = { to_sun = 'y', turbidity = ¦1 }\n", "from 1.7 to 10", ""),
    ("[sky]\nsun_sky = { to_sun = 'y', angle = ¦0 }\n", "from 0.02 to 90", ""),
    ("[sky]\nsun_sky = { to_sun = ¦[0, 0, 0] }\n", "", ""),
    ("[sky]\nsun_sky = { to_sun = 'y', ground = ¦2 }\n", "found 2", ""),
    ("[sky]\nsun_sky = ¦{ turbidity = 3 }\n", "the key `to_sun` is missing", ""),
    ("light = [{ sun = { to_light = 'y', irradiance = 1, angle = ¦91 } }]\n", "found 91", ""),
];

const SYNTAX: &[Case] = &[
    ("[camera]\nfov = 40\n¦fov = 41\n", "duplicate key", ""),
    ("[camera\nfov = 40\n", "", ""),
    ("# ä ö ü\n[camera] # ß\nfov = ¦40 x\n", "", ""),
    ("[sky]\r\nradiance = 1\r\nambient = ¦-1\r\n", "found -1", ""),
    ("sky = { radiance = [1, 1, 1], /* ä */ }\n", "", ""),
];

/// Line and column of the mark, and the text without it.
fn place(marked: &str) -> (Option<(usize, usize)>, String) {
    let text = marked.replace('¦', "");
    let mark = marked.find('¦').map(|at| {
        let before = &marked[..at];
        let start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
    });
    (mark, text)
}

fn check(cases: &[Case]) {
    let mut wrong = String::new();
    for (marked, message, help) in cases {
        let (mark, text) = place(marked);
        let found = bad(&text);
        let at = found.line.zip(found.column);
        let placed = at.is_some() && (mark.is_none() || at == mark);
        let helped = found.help.as_deref().unwrap_or("").contains(help);
        if !(placed && helped && found.message.contains(message)) {
            wrong += &format!("{marked}=> {found}\n\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn unknown_names_are_shown_with_the_nearest() {
    check(NAMES);
}

#[test]
fn wrong_types_are_shown_where_they_stand() {
    check(TYPES);
}

#[test]
fn empty_names_of_files_are_shown_where_they_stand() {
    check(UNNAMED);
}

#[test]
fn values_out_of_range_are_shown_where_they_stand() {
    check(RANGES);
}

#[test]
fn values_that_do_not_go_together_are_shown() {
    check(TOGETHER);
}

#[test]
fn skies_that_are_none_are_shown_where_they_stand() {
    check(SKIES);
}

#[test]
fn images_that_send_no_light_are_refused_at_their_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let refusal = |strength: &str, texels: [f32; 3]| {
        let image = image::Rgb32FImage::from_pixel(4, 2, image::Rgb(texels));
        image.save(folder.path().join("sky.exr")).expect("written");
        std::fs::write(&path, format!("[sky]\nimage = 'sky.exr'\n{strength}\n")).expect("written");
        match load(&path, &LoadOptions::default()) {
            Err(Error::Input(d)) => {
                assert_eq!((d.line, d.column), (Some(2), Some(9)), "{d}");
                Some(d.message)
            }
            Err(error) => panic!("{error}"),
            Ok(_) => None,
        }
    };
    let says = |strength, texels, what| {
        let message = refusal(strength, texels).expect("an error");
        assert!(message.contains(what), "{message}");
    };
    says("", [0.0; 3], "sky.exr: the image is black everywhere, so it lights nothing");
    says("", [1.0, f32::NAN, 0.0], "not a finite number");
    says("", [1.0, f32::INFINITY, 0.0], "not a finite number");
    says("strength = 1e20", [1e20; 3], "sky.exr: the image is too bright");
    assert_eq!(refusal("strength = 1e20", [1.0; 3]), None);
    // Of lossy compression.
    assert_eq!(refusal("", [1.0, -1e-5, 0.0]), None);
    let loaded = load(&path, &LoadOptions::default()).expect("a scene");
    assert!(
        loaded.warnings[0].message.contains("numbers below 0 are cut"),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn syntax_errors_have_their_place() {
    check(SYNTAX);
}

#[test]
fn columns_count_characters() {
    let named = bad("[material.\"ä ö\"]\ndiffuse = 2\n");
    assert_eq!((named.line, named.column), (Some(2), Some(11)));
    let inline = bad("material = { \"äöü\" = { diffuse = 2 } }\n");
    assert_eq!((inline.line, inline.column), (Some(1), Some(34)));
}

#[test]
fn a_file_that_is_not_text_is_refused_with_the_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, b"[sky]\n# \xff\n").expect("written");
    let Err(Error::Input(d)) = load(&path, &LoadOptions::default()) else { panic!("an error") };
    assert_eq!((d.line, d.column), (Some(2), Some(3)));
    let none = load(&folder.path().join("none.toml"), &LoadOptions::default());
    assert!(matches!(none, Err(Error::Io { .. })));
}

#[test]
fn deep_nesting_is_refused_not_fatal() {
    let deep = format!("camera = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(bad(&deep).line.is_some());
}

#[test]
fn a_fault_inside_a_mesh_file_is_shown_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, "[[mesh]]\nfile = 'bad.obj'\n").expect("written");
    std::fs::write(folder.path().join("bad.obj"), "v 0 0 0\nv 0 nan 0\n").expect("written");
    let Err(Error::Input(d)) = load(&path, &LoadOptions::default()) else { panic!("an error") };
    assert_eq!((d.file, d.line), (folder.path().join("bad.obj"), Some(2)));
}
