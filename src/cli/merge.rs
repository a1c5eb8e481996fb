//! `planisphere merge`: parts in, the planes of the whole out.

use std::time::Instant;

use serde::Serialize;

use super::{
    Failure,
    args::{MergeRequest, named},
    ends::Ends,
    print,
    progress::Progress,
    render::{doing, milliseconds, region_inside, rounded},
    say, unless_changed,
};
use planisphere_io::part;
use planisphere_renderer::{Region, files::Merging};

/// What `--stats` prints. Fields are added, never changed, while `version` is 1.
#[derive(Serialize)]
struct Stats {
    version: u32,
    /// Columns and rows of the whole image.
    image: [u32; 2],
    /// Column, row, width and height of what was merged.
    region: [u32; 4],
    counts: Counts,
    milliseconds: Milliseconds,
}

/// What there was to do.
#[derive(Serialize)]
struct Counts {
    parts: usize,
    /// Spheres that were drawn in the parts.
    spheres: u64,
    /// Spheres that are seen in any part.
    seen: u64,
    pixels: usize,
    /// Pairs of hits at a pixel that the bounds of their distances left to be decided exactly.
    undecided: u64,
    /// Signs among these that took integers of any size.
    exact: u64,
}

/// Wall-clock time of each step. A step that was not needed is 0.
#[derive(Serialize, Default)]
struct Milliseconds {
    load: f64,
    merge: f64,
    depth: f64,
    encode: f64,
    write: f64,
    total: f64,
}

/// Does what was asked; `start` is when the program began.
pub(super) fn run(request: &MergeRequest, start: Instant) -> Result<(), Failure> {
    let sinks = &request.sinks;
    let mut ends = Ends::new(named(sinks), request.stats.then_some("--stats"));
    request.parts.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    let mut times = Milliseconds::default();

    let (step, progress) = (Instant::now(), Progress::step("loading"));
    let (parts, watch) = part::parts(&request.parts)?;
    let size = Merging::size(&parts)?;
    // A part again need not be whole.
    let partial = sinks.picture.is_none() && sinks.ids.is_none() && sinks.depth.is_none();
    let region = match request.region {
        None if partial => None,
        None => Some(Region { x: 0, y: 0, width: size[0], height: size[1] }),
        Some(region) => Some(region_inside(region, size)?),
    };
    let merging = unless_changed(&watch, || Ok(Merging::new(&parts, region, !partial)?))?;
    drop(progress);
    times.load = milliseconds(step);

    let mut progress = None;
    let mut told = |step| {
        // The line of the step before goes first.
        drop(progress.take());
        progress = Some(Progress::step(doing(step)));
    };
    let merged = || Ok(merging.render(sinks, &mut told)?);
    let (staged, report, [undecided, exact]) = unless_changed(&watch, merged)?;
    drop(progress);
    times.merge = rounded(report.times.render);
    (times.depth, times.encode) = (rounded(report.depth), rounded(report.encode));

    let (step, progress) = (Instant::now(), Progress::step("writing"));
    // Names may have come to lead elsewhere meanwhile.
    ends.check()?;
    staged.commit()?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    times.write = milliseconds(step);
    times.total = milliseconds(start);

    if !report.seen {
        say("note: nothing is seen: no part shows a sphere here");
    }

    if request.stats {
        let Region { x, y, width, height } = merging.region();
        let [spheres, seen] = merging.spheres();
        let pixels = width as usize * height as usize;
        let counts = Counts { parts: parts.len(), spheres, seen, pixels, undecided, exact };
        let region = [x, y, width, height];
        let stats = Stats { version: 1, image: size, region, counts, milliseconds: times };
        let json = serde_json::to_string(&stats).expect("numbers and strings are always JSON");
        print(&format!("{json}\n"))?;
    }
    Ok(())
}
