//! `planisphere merge`: parts in, the planes of the whole out.

use std::time::Instant;

use serde::Serialize;

use super::{
    Failure,
    args::{MergeRequest, Outputs},
    ends::Ends,
    planes::{self, Indices, Picture, Spent},
    print,
    progress::Progress,
    render::{milliseconds, region_inside, rounded},
    say, unless_changed,
};
use planisphere_core::{
    depth::PlaneError,
    part::{
        Meta,
        merge::{Merge, MergeError, Ties},
    },
};
use planisphere_io::{
    load::Watch,
    output::{self, Staged},
    part,
};

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

    let (staged, merged) = bands(outputs, &merge, &watch)?;
    times.merge = rounded(merged.milliseconds);
    (times.depth, times.encode) = (rounded(merged.spent.depth), rounded(merged.spent.encode));

    let (step, progress) = (Instant::now(), Progress::step("writing"));
    // Names may have come to lead elsewhere meanwhile.
    ends.check()?;
    output::commit(staged)?.iter().for_each(|note| say(&format!("note: {note}")));
    drop(progress);
    times.write = milliseconds(step);
    times.total = milliseconds(start);

    if !merged.seen {
        say("note: nothing is seen: no part shows a sphere here");
    }

    if request.stats {
        let Meta { region, ranges, .. } = merge.meta();
        let counts = Counts {
            parts: parts.len(),
            spheres: ranges.iter().map(|range| range.end - range.start).sum(),
            seen: merge.scene().len(),
            pixels: region.pixels(),
            undecided: merged.ties.pairs,
            exact: merged.ties.exact,
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

/// What merging has found in all bands, and how long it took.
#[derive(Default)]
struct Merged {
    ties: Ties,
    milliseconds: f64,
    spent: Spent,
    /// Whether any sphere is seen.
    seen: bool,
}

/// Merges all bands, and encodes what is wanted of them.
fn bands(
    outputs: &Outputs,
    merge: &Merge,
    watch: &Watch,
) -> Result<(Vec<Staged>, Merged), Failure> {
    let (meta, scene, truth) = (merge.meta(), merge.scene(), merge.truth());
    let indices = Indices::Each(merge.indices());
    let picture = Picture { meta, scene, truth, indices, band: BAND };
    let mut merged = Merged::default();
    let staged = unless_changed(watch, || {
        planes::write(outputs, &picture, &mut merged.spent, |region| {
            let (step, _progress) = (Instant::now(), Progress::step("merging"));
            let band = merge.band(region)?;
            merged.milliseconds += milliseconds(step);
            merged.ties.pairs += band.ties.pairs;
            merged.ties.exact += band.ties.exact;
            merged.seen = merged.seen || band.ids.iter().any(|id| *id >= 0);
            Ok(band.ids)
        })
        .map_err(|failure| match failure {
            Failure::Plane(PlaneError::NotSeen { id, column, row }) => {
                merge.not_seen(id, column, row).into()
            }
            other => other,
        })
    })?;
    Ok((staged, merged))
}
