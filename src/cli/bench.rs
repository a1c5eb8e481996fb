//! `planisphere bench`: measures, and prints what it has found.

use std::{ffi::OsString, path::PathBuf, process::Command};

use clap::{Args as ClapArgs, Subcommand};

use super::{
    Failure,
    ends::{Ends, stdout_is_open},
    parse::{parse_count, parse_device, parse_repetitions, parse_size},
    print, say,
};
use planisphere_bench::{
    ImageSize, View, accuracy, plot, png,
    process::{self, Cost},
    scenes::Made,
    speed::{self, BenchError, Contender, Settings, TimedRun},
    statistics::Summary,
    table::{Table, number},
};
use planisphere_io::{
    load,
    output::{self, Target},
};
use planisphere_renderer::{Device, MAX_SIDE};

/// `bench`, as typed.
#[derive(ClapArgs)]
pub(super) struct BenchArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Time scenes of every kind and size on every device, as whole processes and frame by frame,
    /// and count wrong pixels
    Speed(SpeedArgs),
    /// Hold every way of drawing against exact decisions: time, wrong pixels, errors of depths, on
    /// easy and hard scenes
    Accuracy(AccuracyArgs),
    /// Time the writing of pictures as PNG, RGB and with a palette, and tell how large the files
    /// are
    #[command(after_long_help = "Example:\n  planisphere bench png scenes/first.toml\n      \
                           benches/png.sh adds a million spheres")]
    Png(PngArgs),
    /// Time whole processes: wall and processor time, peak memory; several commands in turn
    #[command(long_about = "Time whole processes: wall and processor time, peak memory.\n\
                      \n\
                      Several commands are separated by ::: and run in turn; the ratios to the \
                      first are taken round by round, so that what drifts slowly cancels:\n  \
                      planisphere bench time -- planisphere render a.toml -o none --stats ::: \
                      other-program a.txt")]
    Time(TimeArgs),
    /// Open a device, dispatch next to nothing, and end: the bare start-up that `speed` compares
    /// with
    #[command(hide = true)]
    Open {
        /// The device
        #[arg(long, value_parser = parse_device)]
        device: Device,
    },
}

#[derive(ClapArgs)]
struct SpeedArgs {
    /// Measure this scene file instead of the built-in scenes
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    scene: Option<PathBuf>,

    /// Measure one device only: auto, gpu, cpu, or part of an adapter's name; else the CPU, and a
    /// GPU if there is one
    #[arg(long, value_name = "DEVICE", value_parser = parse_device)]
    device: Option<Device>,

    /// Size of the pictures in pixels; 1024x1024, or the scene file's
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,

    /// Frames of each kind; short ones after a camera move are taken up to six times as often
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = parse_repetitions)]
    frames: usize,

    /// Runs of each whole process; 0 for none
    #[arg(long, value_name = "N", default_value_t = 5)]
    runs: usize,

    /// Leave out built-in scenes with more spheres, such as 1e7
    #[arg(long, value_name = "SPHERES", default_value = "1e6", value_parser = parse_count)]
    max: usize,

    /// A small matrix: 1e4 spheres at most
    #[arg(long)]
    quick: bool,

    /// Leave out the baselines
    #[arg(long)]
    no_baselines: bool,

    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
}

#[derive(ClapArgs)]
struct AccuracyArgs {
    /// Measure this scene file instead of the built-in scenes
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    scene: Option<PathBuf>,

    /// Measure one device only: auto, gpu, cpu, or part of an adapter's name; else the CPU, and a
    /// GPU if there is one
    #[arg(long, value_name = "DEVICE", value_parser = parse_device)]
    device: Option<Device>,

    /// Size of the pictures in pixels; 512x512, or the scene file's
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,

    /// Timed pictures of each scene by each method; for the price three times as many pairs, and
    /// more where that takes no four seconds
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = parse_repetitions)]
    frames: usize,

    /// Few and small scenes
    #[arg(long)]
    quick: bool,

    /// Leave out the price of exactness: each device as it is against the same with bounds and
    /// decisions switched off
    #[arg(long)]
    no_price: bool,

    /// Measure the price of exactness only
    #[arg(long, conflicts_with_all = ["no_price", "scene", "plot"])]
    only_price: bool,

    /// Also draw error against time into an SVG file
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    plot: Option<PathBuf>,

    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
}

#[derive(ClapArgs)]
struct PngArgs {
    /// Scene files (TOML)
    #[arg(required = true, value_name = "SCENE", value_hint = clap::ValueHint::FilePath)]
    scenes: Vec<PathBuf>,

    /// Rounds that count; the files are written once before
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = parse_repetitions)]
    runs: usize,

    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(ClapArgs)]
struct TimeArgs {
    /// Rounds that count; one more runs first
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = parse_repetitions)]
    runs: usize,

    /// Run one command once, with no round before, and print its cost as JSON
    #[arg(long)]
    json: bool,

    /// Names of the commands in the table, separated by commas
    #[arg(long, value_delimiter = ',')]
    names: Vec<String>,

    /// The commands, separated by :::
    #[arg(required = true, last = true)]
    commands: Vec<OsString>,
}

/// Measures.
pub(super) fn run(args: BenchArgs) -> Result<(), Failure> {
    match args.what {
        What::Speed(args) => run_speed(args),
        What::Accuracy(args) => run_accuracy(args),
        What::Png(args) => run_png(&args),
        What::Time(args) => run_time(args),
        What::Open { device } => Ok(speed::open(&device)?),
    }
}

/// The device that was asked for, or those that are there.
fn contenders(device: Option<Device>) -> Result<Vec<Contender>, Failure> {
    let Some(choice) = device else { return Ok(speed::devices()) };
    Ok(vec![speed::contender(&choice.to_string(), choice)?])
}

/// A size as it is typed.
fn image([width, height]: [u32; 2]) -> ImageSize {
    ImageSize { width, height }
}

fn run_speed(args: SpeedArgs) -> Result<(), Failure> {
    let mut ends = Ends::new(Vec::new(), Some("the table"));
    args.scene.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    let devices = contenders(args.device)?;
    let program = std::env::current_exe().map_err(BenchError::from)?;
    let mut tell = |what: &str| say(&format!("bench: {what}"));
    let mut settings = Settings {
        image: image(args.size.unwrap_or([1024; 2])),
        frames: args.frames,
        runs: args.runs,
        most: args.max,
        quick: args.quick,
        baselines: !args.no_baselines,
        devices,
        program,
    };
    if 2 * settings.image.width.max(settings.image.height) > MAX_SIDE && args.scene.is_none() {
        let half = MAX_SIDE / 2;
        return Err(Failure::Usage(format!(
            "the matrix holds pictures of twice the size; give --size at most {half}x{half}, or a \
             --scene"
        )));
    }
    let report = match &args.scene {
        None => speed::matrix(&settings, &mut tell)?,
        Some(path) => {
            let loaded = load::load(path)?;
            loaded.files.iter().for_each(|path| ends.reads(path));
            ends.check()?;
            settings.image = args.size.map_or(loaded.image, image);
            let camera = loaded.camera(settings.image);
            let made = Made { name: planisphere_io::text::name(path), scene: loaded.scene, camera };
            speed::one(&settings, &made, &mut tell)?
        }
    };
    if args.json {
        print(
            &(serde_json::to_string(&report).expect("numbers and strings are always JSON") + "\n"),
        )?;
    } else {
        print(&report.text())?;
    }
    match report.devices_wrong() {
        0 => Ok(()),
        wrong => Err(Failure::Check(format!("{wrong} pixels are wrong; none may be"))),
    }
}

fn run_accuracy(args: AccuracyArgs) -> Result<(), Failure> {
    let plot = args.plot.as_deref().map(Target::from_arg);
    if let Some(target) = &plot {
        target.check_ending("--plot", "a plot", "svg")?;
    }
    let plots = plot.iter().map(|target| ("--plot", target)).collect();
    let mut ends = Ends::new(plots, Some("the table"));
    args.scene.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    let devices = contenders(args.device)?;
    let mut tell = |what: &str| say(&format!("bench: {what}"));
    let mut settings = accuracy::Settings {
        image: image(args.size.unwrap_or([512; 2])),
        frames: args.frames,
        quick: args.quick,
        devices,
        scenes: !args.only_price,
        price: !args.no_price,
    };
    let report = match &args.scene {
        None => accuracy::all(&settings, &mut tell)?,
        Some(path) => {
            let loaded = load::load(path)?;
            loaded.files.iter().for_each(|path| ends.reads(path));
            ends.check()?;
            settings.image = args.size.map_or(loaded.image, image);
            let camera = loaded.camera(settings.image);
            let made = Made { name: planisphere_io::text::name(path), scene: loaded.scene, camera };
            accuracy::one(&settings, &made, &mut tell)?
        }
    };
    if let Some(target) = &plot {
        let picture = plot::svg(&report);
        ends.check()?;
        let staged = target.clone().stage(|out| out.write_all(picture.as_bytes()))?;
        output::commit(vec![staged])?.iter().for_each(|note| say(&format!("note: {note}")));
    }
    if args.json {
        print(
            &(serde_json::to_string(&report).expect("numbers and strings are always JSON") + "\n"),
        )?;
    } else {
        print(&report.text())?;
    }
    match report.certain_wrong() {
        0 => Ok(()),
        wrong => Err(Failure::Check(format!("{wrong} pixels are wrong where none may be"))),
    }
}

fn run_png(args: &PngArgs) -> Result<(), Failure> {
    let picture = |path: &PathBuf| -> Result<png::Picture, Failure> {
        let loaded = load::load(path)?;
        let view = View::new(loaded.camera(loaded.image), loaded.image);
        let name = path.display().to_string();
        Ok(png::Picture { name, scene: loaded.scene, view, background: loaded.look.behind() })
    };
    let pictures = args.scenes.iter().map(picture).collect::<Result<Vec<_>, _>>()?;
    let report = png::measure(&pictures, args.runs, &mut |what| say(&format!("bench: {what}")))?;
    if args.json {
        print(
            &(serde_json::to_string(&report).expect("numbers and strings are always JSON") + "\n"),
        )
    } else {
        print(&report.text())
    }
}

fn run_time(args: TimeArgs) -> Result<(), Failure> {
    let commands: Vec<&[OsString]> = args.commands.split(|argument| argument == ":::").collect();
    if commands.iter().any(|command| command.is_empty()) {
        return Err(Failure::Usage("there is no command before or after one of the :::".into()));
    }
    stdout_is_open()?;
    let run = |command: &[OsString]| -> Result<TimedRun, Failure> {
        let ended =
            process::run(Command::new(&command[0]).args(&command[1..])).map_err(|error| {
                Failure::Usage(format!("{} cannot be run: {error}", command[0].to_string_lossy()))
            })?;
        Ok(TimedRun { cost: ended.cost, code: ended.status.code(), errors: ended.errors })
    };
    if args.json {
        let &[command] = &commands[..] else {
            return Err(Failure::Usage("--json takes one command".into()));
        };
        return print(
            &(serde_json::to_string(&run(command)?).expect("numbers and strings are always JSON")
                + "\n"),
        );
    }
    let mut costs: Vec<Vec<Cost>> = vec![Vec::new(); commands.len()];
    for round in 0..=args.runs {
        for (command, costs) in commands.iter().zip(&mut costs) {
            let run = run(command)?;
            if run.code != Some(0) {
                let words = command.join(" ".as_ref());
                return Err(Failure::Check(format!(
                    "{} failed: {}",
                    words.to_string_lossy(),
                    run.errors.trim_end()
                )));
            }
            if round > 0 {
                costs.push(run.cost);
            }
        }
    }
    let mut table = Table::new(&[
        "command",
        "wall ms",
        "least",
        "greatest",
        "cpu ms",
        "peak MB",
        "wall over first",
        "cpu over first",
    ]);
    let walls: Vec<Vec<f64>> =
        costs.iter().map(|costs| costs.iter().map(|cost| cost.wall).collect()).collect();
    let cpus: Vec<Vec<f64>> =
        costs.iter().map(|costs| costs.iter().filter_map(|cost| cost.cpu).collect()).collect();
    for (k, costs) in costs.iter().enumerate() {
        let name = args
            .names
            .get(k)
            .cloned()
            .unwrap_or_else(|| commands[k].join(" ".as_ref()).to_string_lossy().into_owned());
        let wall = Summary::of(&walls[k]);
        let cpu = Summary::of(&cpus[k]);
        let peak = costs.iter().filter_map(|cost| cost.peak).max();
        let ratio = Summary::of_ratios(&walls[k], &walls[0]);
        table.row(vec![
            name,
            number(wall.map(|s| s.median)),
            number(wall.map(|s| s.least)),
            number(wall.map(|s| s.greatest)),
            number(cpu.map(|s| s.median)),
            number(peak.map(|bytes| bytes as f64 * 1e-6)),
            number(ratio.map(|s| s.median)),
            number(Summary::of_ratios(&cpus[k], &cpus[0]).map(|s| s.median)),
        ]);
    }
    print(&table.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_repetitions() {
        assert_eq!((parse_count("1e6"), parse_count("250")), (Ok(1_000_000), Ok(250)));
        for bad in ["", "x", "-1", "1.5", "1e10", "nan"] {
            assert!(parse_count(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_repetitions("7"), Ok(7));
        for bad in ["0", "1001", "x", "-1"] {
            assert!(parse_repetitions(bad).is_err(), "{bad}");
        }
    }
}
