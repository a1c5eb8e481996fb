//! `planisphere merge`: parts in, the planes of the whole out.

use std::time::Instant;

use serde::Serialize;

use super::{
    Failure,
    args::MergeRequest,
    ends::Ends,
    planes::{self, Indices, Picture, Spent},
    print,
    progress::Progress,
    render::{milliseconds, region_inside, rounded},
    say, unless_changed,
};
use planisphere_core::{
    depth::PlaneError,
    part::merge::{Merge, MergeError, Ties},
};
use planisphere_io::{output, part};

/// Pixels that are merged at a time.
const BAND: usize = 1 << 22;

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
    seen: usize,
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
    let outputs = &request.outputs;
    let mut ends = Ends::new(outputs.named(), request.stats.then_some("--stats"));
    request.parts.iter().for_each(|path| ends.reads(path));
    ends.check()?;
    let mut times = Milliseconds::default();

    let (step, progress) = (Instant::now(), Progress::step("loading"));
    let (parts, watch) = part::parts(&request.parts)?;
    let Some(first) = parts.first() else { return Err(MergeError::Nothing.into()) };
    let image = first.meta.view.image;
    // A part again need not be whole.
    let partial = outputs.picture.is_none() && outputs.ids.is_none() && outputs.depth.is_none();
    let region = match request.region {
        None if partial => None,
        region => Some(region_inside(region, image)?),
    };
    let merge = unless_changed(&watch, || {
        let merge = Merge::new(&parts, region)?;
        if !partial {
            merge.check_gaps()?;
        }
        Ok(merge)
    })?;
    drop(progress);
    times.load = milliseconds(step);

    let meta = merge.meta();
    let region = meta.region;
    let mut ties = Ties::default();
    let mut spent = Spent::default();
    let mut seen = false;
    let indices = Indices::Each(merge.indices());
    let picture = Picture { meta, scene: merge.scene(), truth: merge.truth(), indices, band: BAND };
    let staged = unless_changed(&watch, || {
        planes::write(outputs, &picture, &mut spent, |region| {
            let (step, _progress) = (Instant::now(), Progress::step("merging"));
            let band = merge.band(region)?;
            times.merge += milliseconds(step);
            ties.pairs += band.ties.pairs;
            ties.exact += band.ties.exact;
            seen = seen || band.ids.iter().any(|id| *id >= 0);
            Ok(band.ids)
        })
        .map_err(|failure| match failure {
            Failure::Plane(PlaneError::NotSeen { id, column, row }) => {
                merge.not_seen(id, column, row).into()
            }
            other => other,
        })
    })?;
    times.merge = rounded(times.merge);
    (times.depth, times.encode) = (rounded(spent.depth), rounded(spent.encode));

    let (step, progress) = (Instant::now(), Progress::step("writing"));
    // Names may have come to lead elsewhere meanwhile.
    ends.check()?;
    output::commit(staged)?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    times.write = milliseconds(step);
    times.total = milliseconds(start);

    if !seen {
        say("note: nothing is seen: no part shows a sphere here");
    }

    if request.stats {
        let counts = Counts {
            parts: parts.len(),
            spheres: meta.ranges.iter().map(|range| range.end - range.start).sum(),
            seen: merge.scene().len(),
            pixels: region.pixels(),
            undecided: ties.pairs,
            exact: ties.exact,
        };
        let stats = Stats {
            version: 1,
            image: [image.width, image.height],
            region: [region.x, region.y, region.width, region.height],
            counts,
            milliseconds: times,
        };
        let json = serde_json::to_string(&stats).expect("numbers and strings are always JSON");
        print(&format!("{json}\n"))?;
    }
    Ok(())
}
