//! `cargo xtask`: bakes impostors, verifies them and shows them.

use anyhow::Context;
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use xtask::{
    Arrangement, BakeOptions, BakeReport, BitfieldsOptions, BuiltIn, Channels, Console, Device,
    DeviceChoice, Foliage, Limits, MOST_VIEWS, Making, SampleChoice, SceneChoice, SeenFrom,
    VerifyOptions, VerifyReport, ViewCellSpec, ViewMode, ViewOptions, Views, WindowOptions,
    bake_bitfields, bake_on, cells_from_argument, distances_from_argument, export, page_content,
    page_program, picture_size, require_export, require_layers, require_volume, serve, verify_on,
    window,
};

/// Replaces far or dense parts of 3-D scenes by image-based impostors, and proves that they look
/// right.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Bakes a scene into a bundle: glTF, atlas pages and a manifest.
    Bake(Box<BakeArgs>),
    /// Renders original and bundle from the whole view cell and checks the bundle's promise.
    Verify(VerifyArgs),
    /// Shows a bundle beside its original.
    View(ViewArgs),
}

#[derive(Args)]
struct BakeArgs {
    /// A glTF (.glb, .gltf), OBJ or PLY file, or a built-in scene: town[:TRIANGLES[:SEED]] (from
    /// 1e5 to 1e7 triangles) or house. [default: town]
    #[arg(value_parser = OsStringValueParser::new().try_map(SceneChoice::from_argument))]
    scene: Option<SceneChoice>,
    /// How the impostor is made.
    #[arg(long, value_enum, default_value_t = Technique::Layered)]
    technique: Technique,
    /// Where the viewer may be: box:cx,cy,cz:sx,sy,sz (centre and size in metres), or
    /// shaft:dx,dy,dz:half_angle:min[:max] (direction from the scene's centre to the viewers,
    /// degrees, distances in metres).
    /// Without, objects far from all else and domes around it are left out, with a warning.
    /// Of bitfields a box, which may lie amid the scene, and the viewer looks anywhere; without, the
    /// viewer is around the scene.
    /// [default: a cube of half the scene's largest extent, one extent before its +Z side]
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    view_cell: Option<ViewCellSpec>,
    /// Puts the view cell amid the scene: objects that lie wholly at this distance from it or beyond,
    /// in metres, are baked into up to six impostors round it. Needs --view-cell box:...
    #[arg(long, value_name = "DISTANCE", value_parser = positive, requires = "view_cell")]
    far: Option<f64>,
    /// For viewers anywhere around the scene, at least this far from its centre, in metres: up to
    /// six impostors of all. [default: eight times the diagonal of the scene's box]
    #[arg(long, value_name = "DISTANCE", value_parser = positive, num_args = 0..=1,
        require_equals = true, conflicts_with_all = ["view_cell", "far"])]
    views_around: Option<Option<f64>>,
    /// Pixels along each side of the viewer's picture.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=16384))]
    resolution: u32,
    /// The viewer's field of view in degrees.
    #[arg(long, default_value_t = 45.0, value_parser = field_of_view)]
    fov: f64,
    /// Leaves out all objects of this name; may be repeated.
    #[arg(long, value_name = "NAME")]
    exclude: Vec<String>,
    /// What a quad is worth in bytes: more gives fewer quads and larger pages. [default: 104]
    #[arg(long, value_name = "BYTES", value_parser = positive)]
    bytes_per_quad: Option<f64>,
    /// Of meshes, how far they may pass from what they stand for: the side of a voxel, in voxels, when
    /// it is asked whether the mesh touches it, from 1 to 2. More gives fewer triangles. [default: 1.5]
    #[arg(long, value_name = "FACTOR", value_parser = enlargement)]
    enlarge: Option<f64>,
    /// The most triangles that the impostors may have: larger quads, or larger voxels of meshes, are
    /// tried to stay within it.
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
    max_triangles: Option<u64>,
    /// The most bytes that uncompressed pages, vertices and indices may take.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u64).range(1..))]
    max_bytes: Option<u64>,
    /// Longest side of an atlas page, in texels. [default: 4096]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(64..=16384))]
    page_size: Option<u32>,
    /// How leaves and other masked materials are recorded. [default: any]
    #[arg(long, value_enum)]
    foliage: Option<FoliageArg>,
    /// What the pages hold. [default: lit]
    #[arg(long, value_enum)]
    channels: Option<ChannelsArg>,
    /// Of bitfields, from where the scene is looked at: as many directions, spread evenly, or those of
    /// the viewpoints in a file, a line `x y z` each, in metres. Pixels that are missed are counted
    /// then, and promised not to become more.
    /// [default: from where it is needed, until nothing is missed]
    #[arg(long, value_name = "COUNT|FILE",
        value_parser = OsStringValueParser::new().try_map(SampleChoice::from_argument))]
    samples: Option<SampleChoice>,
    /// Of bitfields, the least and the greatest distance of the viewer from the scene's centre, in
    /// metres. [default: those of the viewpoints in the file of --samples, or else from where the scene
    /// fits into the picture to four times as far]
    #[arg(long, value_name = "MIN:MAX", value_parser = distances_from_argument)]
    distances: Option<[f64; 2]>,
    /// Of bitfields without --samples, how many views one after another must miss nothing, that the samples
    /// were not taken from. As many others, 1000 at least, tell what is promised, with --samples too; with a
    /// view cell 1000. [default: 3000, and with a view cell 100 in each of its cells, all around]
    #[arg(long, value_name = "VIEWS", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    held_back: Option<u32>,
    /// Of bitfields without --samples, how many pixels each of these views may miss and still not call for
    /// more: the more, the sooner it is done, with fewer viewpoints and shorter lists. What is promised is
    /// measured in the end. [default: 0]
    #[arg(long, value_name = "N", conflicts_with = "samples")]
    tolerated_pixels: Option<u64>,
    /// Of bitfields, whether triangles that share a vertex with one that a sample sees, and face it, are
    /// taken for seen too: less is missed, and less is culled. [default: true, but false with --samples or
    /// a view cell]
    #[arg(long, value_name = "BOOL", action = clap::ArgAction::Set, num_args = 1)]
    neighbors: Option<bool>,
    /// Of bitfields, chooses other views to be held back. [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// What records layers. The bundle is the same on all.
    #[arg(long, value_enum, default_value_t = DeviceArg::DEFAULT)]
    device: DeviceArg,
    /// Of bitfields with a --view-cell, into how many cells along x, y and z that box is cut, each with a
    /// list of what is drawn. [default: 1,1,1]
    #[arg(long, value_name = "X,Y,Z", requires = "view_cell", value_parser = cells_from_argument)]
    cells: Option<[u32; 3]>,
    /// Verifies the bundle from 256 viewpoints, as `verify` does.
    #[arg(long)]
    verify: bool,
    /// The bundle's folder. [default: target/farfield/<scene>-<technique>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Writes the recorded layers there for people to look at, as OpenEXR and contact sheets, and what was
    /// made of them, as glTF with its pages.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Technique {
    /// Textured quads on parallel layers.
    Layered,
    /// Textured depth meshes: layers connected and simplified, for what is near.
    Tdm,
    /// The original geometry, and for each direction the ranges of it that can be seen: for dense
    /// models seen from near, from all around.
    Bitfields,
    /// Whichever is predicted to take fewer bytes of pages, 52 bytes a triangle added, told before
    /// either is made; where that cannot be made or misses the limits, the other.
    Auto,
}

#[derive(Clone, Copy, ValueEnum)]
enum FoliageArg {
    /// Anything that is there sets a texel: no gaps, but leaves reach up to a texel too far.
    Any,
    /// The middle of a texel decides: as much is covered as by the original, with gaps.
    Centre,
}

#[derive(Clone, Copy, ValueEnum)]
enum ChannelsArg {
    /// Colours under a plain sun and sky, shown as they are.
    Lit,
    /// Base colours, shown as they are.
    Unlit,
    /// Base colours, normals, metallic and roughness, for engines that light them.
    Pbr,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum DeviceArg {
    /// A GPU where there is one, else the CPU; a driver that does without a GPU counts as none.
    Auto,
    /// The CPU alone.
    Cpu,
    /// A GPU, or a driver that does without one. Needs a program built with the feature `gpu`:
    /// `cargo xtask-gpu`.
    Gpu,
}

impl DeviceArg {
    const DEFAULT: Self = match cfg!(feature = "gpu") {
        true => Self::Auto,
        false => Self::Cpu,
    };

    fn open(self) -> anyhow::Result<Device> {
        let choice = match self {
            Self::Auto => DeviceChoice::Auto,
            Self::Cpu => DeviceChoice::Cpu,
            Self::Gpu => DeviceChoice::Gpu,
        };
        Device::open(choice, &Console::Stderr)
    }
}

/// Viewpoints that a bundle is verified from unless asked otherwise.
const VIEWS: u64 = 256;

#[derive(Args)]
struct VerifyArgs {
    /// The bundle's folder.
    dir: PathBuf,
    /// The original, where it is no longer where it was baked from.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// How many viewpoints: the reference viewpoint, the cell's corners, edge and face centres,
    /// then an even sequence of points inside; of bitfields directions and distances in no order.
    #[arg(long, default_value_t = VIEWS, value_parser = clap::value_parser!(u64).range(1..=MOST_VIEWS))]
    views: u64,
    /// Looks from this viewpoint only, and writes its pictures.
    #[arg(long, value_name = "N", conflicts_with = "views", value_parser = clap::value_parser!(u64).range(..MOST_VIEWS))]
    view: Option<u64>,
    /// What records layers, to tell whether parts without an impostor can be seen. Pictures are always
    /// drawn by the CPU: at the edges of triangles a GPU's depend on the GPU.
    #[arg(long, value_enum, default_value_t = DeviceArg::DEFAULT)]
    device: DeviceArg,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ViewArgs {
    /// The bundle's folder.
    dir: PathBuf,
    /// The original, where it is no longer where it was baked from. Where it is not there at all, the
    /// impostor is shown alone.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Serves a page for a browser on this machine, in place of a window. Needs Node.js and npm to build the page once.
    #[arg(long)]
    web: bool,
    /// The port to serve the page on. [default: one that is free]
    #[arg(long, value_name = "N", requires = "web")]
    port: Option<u16>,
    /// Writes the page into a folder that any web server can show, instead of serving it.
    #[arg(long, value_name = "FOLDER", requires = "web", conflicts_with = "port")]
    export: Option<PathBuf>,
    /// Begins at this viewpoint, as `verify` counts.
    #[arg(long, value_name = "N", conflicts_with = "web", value_parser = clap::value_parser!(u64).range(..MOST_VIEWS))]
    view: Option<u64>,
    /// What is shown of original and impostor. [default: split, or the impostor where it is alone]
    #[arg(long, value_enum, conflicts_with = "web")]
    mode: Option<ViewMode>,
    /// Width and height of the picture in pixels, as in 800x600. [default: as many as were promised]
    #[arg(long, value_name = "WxH", conflicts_with = "web", value_parser = picture_size)]
    size: Option<[u32; 2]>,
    /// Writes the picture to a PNG file, without a window.
    #[arg(long, value_name = "FILE", conflicts_with = "web")]
    screenshot: Option<PathBuf>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Command::Bake(args) => run_bake(*args),
        Command::Verify(args) => run_verify(args),
        Command::View(args) => run_view(args),
    };
    done.unwrap_or_else(|error| {
        Console::Stderr.error(&error);
        ExitCode::from(1)
    })
}

fn run_bake(args: BakeArgs) -> anyhow::Result<ExitCode> {
    let (must_verify, json) = (args.verify, args.json);
    let understood = refuse_options_of_others(&args).and_then(|()| seen_from(&args));
    let seen_from = understood.unwrap_or_else(|why| refuse(&why));
    let device = match args.technique {
        Technique::Bitfields => Device::cpu(),
        Technique::Layered | Technique::Tdm | Technique::Auto => args.device.open()?,
    };
    let report = match args.technique {
        Technique::Bitfields => {
            bake_bitfields(&bitfields_options(args, seen_from), &Console::Stderr)?
        }
        Technique::Layered | Technique::Tdm | Technique::Auto => {
            bake_on(&impostor_options(args), &device, &Console::Stderr)?
        }
    };
    let verified = match must_verify {
        true => Some(verify_on(
            &VerifyOptions {
                dir: report.bundle.clone(),
                scene: None,
                views: Views::First(VIEWS),
            },
            &device,
            &Console::Stderr,
        )?),
        false => None,
    };
    let holds = verified.as_ref().is_none_or(|report| report.holds);
    if json {
        print_json(&BakeOutput {
            report,
            verify: verified,
        })?;
    }
    Ok(exit_code(holds))
}

/// Ends the program as clap does where options of `bake` do not go together.
fn refuse(why: &str) -> ! {
    let mut cli = Cli::command();
    cli.build();
    let bake = cli.find_subcommand_mut("bake").expect("it is a command");
    bake.error(ErrorKind::ArgumentConflict, why).exit()
}

/// Refuses what the technique that is asked for would ignore.
fn refuse_options_of_others(args: &BakeArgs) -> Result<(), String> {
    let of_impostors = [
        ("--far", args.far.is_some()),
        ("--views-around", args.views_around.is_some()),
        ("--bytes-per-quad", args.bytes_per_quad.is_some()),
        ("--enlarge", args.enlarge.is_some()),
        ("--max-triangles", args.max_triangles.is_some()),
        ("--max-bytes", args.max_bytes.is_some()),
        ("--page-size", args.page_size.is_some()),
        ("--foliage", args.foliage.is_some()),
        ("--channels", args.channels.is_some()),
        ("--dump", args.dump.is_some()),
        ("--device gpu", args.device == DeviceArg::Gpu),
    ];
    let of_bitfields = [
        ("--samples", args.samples.is_some()),
        ("--distances", args.distances.is_some()),
        ("--held-back", args.held_back.is_some()),
        ("--tolerated-pixels", args.tolerated_pixels.is_some()),
        ("--neighbors", args.neighbors.is_some()),
        ("--cells", args.cells.is_some()),
        ("--seed", args.seed.is_some()),
    ];
    let given = |options: &[(&'static str, bool)]| {
        let given = options.iter().filter(|(_, is_given)| *is_given);
        given.map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
    };
    match args.technique {
        Technique::Bitfields => match given(&of_impostors) {
            none if none.is_empty() => Ok(()),
            some => Err(format!(
                "{some}: not for --technique bitfields, which draws the original geometry, without layers \
                 and pages; leave this out, or choose another technique"
            )),
        },
        Technique::Layered | Technique::Tdm | Technique::Auto => match given(&of_bitfields) {
            none if none.is_empty() => Ok(()),
            some => Err(format!("{some}: for --technique bitfields only")),
        },
    }
}

fn scene_choice(named: Option<SceneChoice>) -> SceneChoice {
    named.unwrap_or(SceneChoice::BuiltIn(BuiltIn::default()))
}

/// Where the viewer of bitfields is.
fn seen_from(args: &BakeArgs) -> Result<SeenFrom, String> {
    match (args.technique, args.view_cell) {
        (Technique::Bitfields, Some(ViewCellSpec::Box { center, size })) => {
            if args.distances.is_some() || args.samples.is_some() {
                return Err(
                    "--distances and --samples are for viewers all around the scene: leave them out, or \
                     --view-cell"
                        .into(),
                );
            }
            require_volume(size)?;
            Ok(SeenFrom::Inside {
                center,
                size,
                cells: args.cells.unwrap_or([1; 3]),
            })
        }
        (Technique::Bitfields, Some(ViewCellSpec::Shaft { .. })) => Err(
            "the view cell of --technique bitfields is a box: --view-cell box:cx,cy,cz:sx,sy,sz; leave it \
             out for viewers all around the scene"
                .into(),
        ),
        _ => Ok(SeenFrom::Around {
            distances: args.distances,
            samples: args.samples.clone().unwrap_or(SampleChoice::Adaptive),
        }),
    }
}

fn bitfields_options(args: BakeArgs, seen_from: SeenFrom) -> BitfieldsOptions {
    let options = BitfieldsOptions::new(scene_choice(args.scene));
    BitfieldsOptions {
        exclude: args.exclude,
        resolution: args.resolution,
        fov_degrees: args.fov,
        seen_from,
        held_back: args.held_back,
        tolerated_pixels: args.tolerated_pixels.unwrap_or(options.tolerated_pixels),
        neighbors: args.neighbors,
        seed: args.seed.unwrap_or(options.seed),
        out: args.out,
        ..options
    }
}

fn impostor_options(args: BakeArgs) -> BakeOptions {
    let layered = Making::Layered {
        bytes_per_quad: args.bytes_per_quad.unwrap_or(104.0),
    };
    let tdm = Making::Tdm {
        enlarged: args.enlarge.unwrap_or(1.5),
    };
    BakeOptions {
        scene: scene_choice(args.scene),
        view_cell: args.view_cell,
        arrangement: match (args.far, args.views_around) {
            (Some(distance), _) => Arrangement::Far(distance),
            (None, Some(distance)) => Arrangement::Around(distance),
            (None, None) => Arrangement::Before,
        },
        resolution: args.resolution,
        fov_degrees: args.fov,
        exclude: args.exclude,
        making: match args.technique {
            Technique::Layered | Technique::Auto | Technique::Bitfields => layered,
            Technique::Tdm => tdm,
        },
        alternative: match args.technique {
            Technique::Layered | Technique::Tdm | Technique::Bitfields => None,
            Technique::Auto => Some(tdm),
        },
        limits: Limits {
            triangles: args.max_triangles,
            bytes: args.max_bytes,
        },
        page_size: args.page_size.unwrap_or(4096),
        foliage: match args.foliage {
            None | Some(FoliageArg::Any) => Foliage::Any,
            Some(FoliageArg::Centre) => Foliage::Centre,
        },
        channels: match args.channels {
            None | Some(ChannelsArg::Lit) => Channels::Lit,
            Some(ChannelsArg::Unlit) => Channels::Unlit,
            Some(ChannelsArg::Pbr) => Channels::Pbr,
        },
        out: args.out,
        dump: args.dump,
    }
}

/// What `bake --json` prints.
#[derive(serde::Serialize)]
struct BakeOutput {
    #[serde(flatten)]
    report: BakeReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    verify: Option<VerifyReport>,
}

fn exit_code(holds: bool) -> ExitCode {
    match holds {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(3),
    }
}

fn run_verify(args: VerifyArgs) -> anyhow::Result<ExitCode> {
    if args.device == DeviceArg::Gpu {
        require_layers(&args.dir)?;
    }
    let options = VerifyOptions {
        dir: args.dir,
        scene: args.scene,
        views: match args.view {
            Some(view) => Views::One(view),
            None => Views::First(args.views),
        },
    };
    let device = args.device.open()?;
    let report: VerifyReport = verify_on(&options, &device, &Console::Stderr)?;
    if args.json {
        print_json(&report)?;
    }
    Ok(exit_code(report.holds))
}

fn run_view(args: ViewArgs) -> anyhow::Result<ExitCode> {
    if let Some(folder) = &args.export {
        require_export(folder, &args.dir)?;
    }
    let options = ViewOptions {
        dir: args.dir,
        scene: args.scene,
    };
    if !args.web {
        let begin = WindowOptions {
            view: args.view,
            mode: args.mode,
            size: args.size,
            screenshot: args.screenshot,
        };
        let status = window(&options, &begin)?;
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        return Ok(ExitCode::from(code.unwrap_or(1)));
    }
    let console = &Console::Stderr;
    let mut files = page_content(&options, console)?;
    files.extend(page_program(console)?);
    match args.export {
        Some(folder) => export(&folder, &options.dir, &files, console)?,
        None => serve(files, args.port.unwrap_or(0), console)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// One JSON object on stdout, where machines read it.
fn print_json(report: &impl serde::Serialize) -> anyhow::Result<()> {
    let line = serde_json::to_string(report)? + "\n";
    std::io::stdout()
        .write_all(line.as_bytes())
        .context("cannot write to stdout")
}

fn field_of_view(text: &str) -> Result<f64, String> {
    let degrees = positive(text)?;
    match (0.01..170.0).contains(&degrees) {
        true => Ok(degrees),
        false => Err("a field of view lies between 0.01 and 170 degrees".into()),
    }
}

fn enlargement(text: &str) -> Result<f64, String> {
    let factor = positive(text)?;
    match (1.0..=2.0).contains(&factor) {
        true => Ok(factor),
        false => Err("voxels are enlarged by a factor from 1 to 2".into()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text
        .parse()
        .map_err(|_| format!("'{text}' is not a number"))?;
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(format!("{text} is not positive"))
    }
}
