//! The plot of `bench accuracy`: error against time, one panel a scene, one mark a method and
//! device, as SVG.
//!
//! Panels share their axes: time per pixel to the right, wrong pixels of a million upwards, both
//! logarithmic; a band below them is for zero. Methods are told apart by colour and shape, which
//! the legend names; panels need no other words.

use std::fmt::Write;

use super::{
    accuracy::{Method, Report, Row},
    table::count,
};

const COLUMNS: usize = 4;
/// A panel and the room around it.
const WIDE: f64 = 250.0;
const HIGH: f64 = 216.0;
const GAP_X: f64 = 38.0;
const GAP_Y: f64 = 50.0;
/// Around all panels.
const LEFT: f64 = 78.0;
const RIGHT: f64 = 24.0;
const BOTTOM: f64 = 64.0;
/// Of the band of zeros, on the floor of a panel; marks that would overlap lie above each other in
/// it.
const ZERO: f64 = 74.0;
/// Of one row of marks in that band, and the width that a mark takes up.
const LANE: f64 = 14.0;
const MARK: f64 = 14.5;
/// Above a million.
const HEAD: f64 = 12.0;

/// Colours that people with any colour vision tell apart (Okabe and Ito, 2008).
fn color(method: Method) -> &'static str {
    match method {
        Method::Textbook => "#d55e00",
        Method::Geometric => "#e69f00",
        Method::Shifted => "#cc79a7",
        Method::Uncertified => "#56b4e9",
        Method::FilterOnly => "#0072b2",
        Method::Full => "#009e73",
        Method::Exact => "#000000",
    }
}

/// A mark: filled for the CPU, hollow for a GPU, each method with its own shape.
fn mark(method: Method, on_cpu: bool, x: f64, y: f64) -> String {
    let color = color(method);
    let fill = if on_cpu { color } else { "#ffffff" };
    let style =
        format!("fill=\"{fill}\" fill-opacity=\"0.85\" stroke=\"{color}\" stroke-width=\"1.8\"");
    let polygon = |points: &[(f64, f64)]| {
        let points: Vec<String> =
            points.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!("<polygon points=\"{}\" {style}/>", points.join(" "))
    };
    match method {
        Method::Textbook => polygon(&[(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)]),
        Method::Geometric => polygon(&[(0.0, -6.5), (6.5, 0.0), (0.0, 6.5), (-6.5, 0.0)]),
        Method::Shifted => polygon(&[(0.0, -6.5), (6.0, 5.0), (-6.0, 5.0)]),
        Method::Uncertified => polygon(&[(0.0, 6.5), (6.0, -5.0), (-6.0, -5.0)]),
        Method::FilterOnly => polygon(&[(-6.5, -3.5), (6.5, -3.5), (6.5, 3.5), (-6.5, 3.5)]),
        Method::Full => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5.6\" {style}/>"),
        Method::Exact => polygon(&[(-3.5, -6.5), (3.5, -6.5), (3.5, 6.5), (-3.5, 6.5)]),
    }
}

/// A range of powers of ten that holds all numbers.
fn decades(values: impl Iterator<Item = f64>) -> Option<[i32; 2]> {
    let logs = values.filter(|value| value.is_finite() && *value > 0.0).map(f64::log10);
    let (low, high) = logs
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| (low.min(log), high.max(log)));
    (low <= high).then(|| {
        let low = low.floor() as i32;
        [low, (high.ceil() as i32).max(low + 1)]
    })
}

/// Wrong pixels of a million.
fn wrong(row: &Row) -> f64 {
    row.wrong.total() as f64 * 1e6 / row.compared.max(1) as f64
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A power of ten as a label.
fn power(exponent: i32) -> String {
    match exponent {
        0..=3 => 10i32.pow(exponent as u32).to_string(),
        -2..=-1 => format!("{}", 10f64.powi(exponent)),
        _ => format!("10<tspan dy=\"-5\" font-size=\"9\">{exponent}</tspan>"),
    }
}

/// The picture.
pub fn svg(report: &Report) -> String {
    let plot = Plot::new(report);
    let mut out = plot.head();
    out += &plot.legend();
    for k in 0..plot.scenes.len() {
        out += &plot.panel(k);
    }
    out + &plot.foot()
}

/// What is written where in a picture.
struct Plot<'a> {
    report: &'a Report,
    /// Of each panel: name and count of spheres.
    scenes: Vec<(&'a str, usize)>,
    /// Methods, whether on the CPU, with their words.
    legend: Vec<(Method, bool, String)>,
    /// First and last power of ten to the right.
    x: [i32; 2],
    /// And upwards.
    y: [i32; 2],
    /// Panels side by side.
    columns: usize,
    /// Words of the legend side by side.
    per_line: usize,
    /// Where the panels begin.
    top: f64,
    width: f64,
    height: f64,
}

/// Where a panel lies.
struct Panel {
    /// Its left edge.
    x: f64,
    /// Its lower edge.
    floor: f64,
    /// Whether it is the first of its line.
    first: bool,
    /// Whether none lies below it.
    lowest: bool,
}

impl<'a> Plot<'a> {
    /// Of all rows of a report.
    fn new(report: &'a Report) -> Self {
        let mut scenes: Vec<(&str, usize)> = Vec::new();
        for row in &report.rows {
            if !scenes.contains(&(&row.scene, row.spheres)) {
                scenes.push((&row.scene, row.spheres));
            }
        }
        let mut legend: Vec<(Method, bool, String)> = Vec::new();
        for row in &report.rows {
            let on_cpu = row.device == "cpu";
            if !legend.iter().any(|(method, cpu, _)| (*method, *cpu) == (row.method, on_cpu)) {
                legend.push((row.method, on_cpu, format!("{}, {}", row.words, row.device)));
            }
        }
        legend.sort_by_key(|(method, on_cpu, _)| {
            (!on_cpu, Method::ALL.iter().position(|m| m == method))
        });

        let columns = scenes.len().clamp(1, COLUMNS);
        let lines = scenes.len().div_ceil(columns).max(1);
        let width = LEFT + RIGHT + columns as f64 * (WIDE + GAP_X) - GAP_X;
        let per_line = (((width - LEFT) / 170.0) as usize).max(1);
        let legend_lines = legend.len().div_ceil(per_line);
        let top = 80.0 + 22.0 * legend_lines as f64;
        Self {
            report,
            scenes,
            legend,
            x: decades(report.rows.iter().map(|row| row.ns_per_pixel)).unwrap_or([0, 1]),
            y: decades(report.rows.iter().map(wrong)).unwrap_or([0, 1]),
            columns,
            per_line,
            top,
            width,
            height: top + lines as f64 * (HIGH + GAP_Y) + BOTTOM,
        }
    }

    /// The beginning of the file, with what stands above the legend.
    fn head(&self) -> String {
        let Self { report, width, height, .. } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" \
             height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             font-family=\"sans-serif\" font-size=\"12\" fill=\"#222222\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
             <text x=\"{LEFT}\" y=\"28\" font-size=\"17\" font-weight=\"bold\">Wrong pixels \
             against time, {} x {} pixels</text>\n\
             <text x=\"{LEFT}\" y=\"47\">Filled: CPU; hollow: GPU. What a filter alone leaves \
             open is not counted as wrong.</text>\n",
            report.image[0], report.image[1]
        )
    }

    /// Which mark stands for which method.
    fn legend(&self) -> String {
        let mut out = String::new();
        for (k, (method, on_cpu, words)) in self.legend.iter().enumerate() {
            let (column, line) = (k % self.per_line, k / self.per_line);
            let (x, y) = (LEFT + 8.0 + column as f64 * 170.0, 70.0 + line as f64 * 22.0);
            let _ = writeln!(out, "{}", mark(*method, *on_cpu, x, y));
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + 13.0,
                y + 4.0,
                escaped(words)
            );
        }
        out
    }

    /// How far to the right of its panel's edge a time lies.
    fn across(&self, ns: f64) -> f64 {
        let [first, last] = self.x;
        (ns.max(1e-300).log10() - f64::from(first)) / f64::from(last - first) * WIDE
    }

    /// How far above its panel's floor a number of wrong pixels lies, which is not zero.
    fn up(&self, wrong: f64) -> f64 {
        let [first, last] = self.y;
        let share = (wrong.log10() - f64::from(first)) / f64::from(last - first);
        ZERO + HEAD + share * (HIGH - ZERO - 2.0 * HEAD)
    }

    /// One scene: its name, axes, and marks.
    fn panel(&self, k: usize) -> String {
        let (column, line) = (k % self.columns, k / self.columns);
        let panel = Panel {
            x: LEFT + column as f64 * (WIDE + GAP_X),
            floor: self.top + line as f64 * (HIGH + GAP_Y) + GAP_Y - 14.0 + HIGH,
            first: column == 0,
            lowest: k + self.columns >= self.scenes.len(),
        };
        let (scene, spheres) = self.scenes[k];
        panel.frame(&format!("{scene}, {}", count(spheres)))
            + &self.times(&panel)
            + &self.heights(&panel)
            + &self.marks(&panel, scene, spheres)
    }

    /// Lines of a panel for each power of ten to the right; words where no panel lies below.
    fn times(&self, &Panel { x, floor, lowest, .. }: &Panel) -> String {
        let mut out = String::new();
        let [first, last] = self.x;
        for exponent in first..=last {
            let at = x + self.across(10f64.powi(exponent));
            let _ = writeln!(
                out,
                "<line x1=\"{at:.1}\" y1=\"{:.1}\" x2=\"{at:.1}\" y2=\"{floor:.1}\" \
                 stroke=\"#dddddd\"/>",
                floor - HIGH
            );
            if lowest {
                let _ = writeln!(
                    out,
                    "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                    floor + 17.0,
                    power(exponent)
                );
            }
        }
        out
    }

    /// The band of zeros of a panel, and lines for each power of ten above it; words left of a
    /// line's first.
    fn heights(&self, &Panel { x, floor, first, .. }: &Panel) -> String {
        let mut out = String::new();
        let mut ticks: Vec<(f64, String)> = (self.y[0]..=self.y[1])
            .map(|exponent| (self.up(10f64.powi(exponent)), power(exponent)))
            .collect();
        ticks.push((0.5 * ZERO, "0".into()));
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"{WIDE}\" height=\"{ZERO}\" fill=\"#009e73\" \
             fill-opacity=\"0.10\" stroke=\"#999999\"/>",
            floor - ZERO
        );
        for (height, label) in ticks {
            let at = floor - height;
            if height > ZERO {
                let _ = writeln!(
                    out,
                    "<line x1=\"{x:.1}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" \
                     stroke=\"#dddddd\"/>",
                    x + WIDE
                );
            }
            if first {
                let _ = writeln!(
                    out,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                    x - 7.0,
                    at + 4.0
                );
            }
        }
        out
    }

    /// A mark for each row of a panel's scene.
    fn marks(&self, &Panel { x, floor, .. }: &Panel, scene: &str, spheres: usize) -> String {
        let mut out = String::new();
        let rows = self.report.rows.iter();
        let mut rows: Vec<&Row> =
            rows.filter(|row| (row.scene.as_str(), row.spheres) == (scene, spheres)).collect();
        rows.sort_by(|a, b| a.ns_per_pixel.total_cmp(&b.ns_per_pixel));
        // Where the last mark of each lane ends.
        let mut lanes = [f64::NEG_INFINITY; ((ZERO - 4.0) / LANE) as usize];
        for row in rows {
            let at_x = x + self.across(row.ns_per_pixel);
            let height = if wrong(row) > 0.0 {
                self.up(wrong(row))
            } else {
                let free = lanes.iter().position(|&end| at_x - end >= MARK).unwrap_or(0);
                lanes[free] = at_x;
                2.0 + LANE * (free as f64 + 0.5)
            };
            let at_y = floor - height;
            let what = format!(
                "{}, {}: {:.1} ns a pixel, {:.1} wrong of a million",
                row.words,
                row.device,
                row.ns_per_pixel,
                wrong(row)
            );
            let mark = mark(row.method, row.device == "cpu", at_x, at_y);
            let _ = writeln!(out, "<g><title>{}</title>{mark}</g>", escaped(&what));
        }
        out
    }

    /// What the axes are, and the end of the file.
    fn foot(&self) -> String {
        let &Self { top, width, height, .. } = self;
        let middle = LEFT + (width - LEFT - RIGHT) / 2.0;
        let center = top + (height - top - BOTTOM) / 2.0;
        format!(
            "<text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\" \
             font-size=\"13\">nanoseconds of processor time per pixel</text>\n\
             <text x=\"22\" y=\"{center:.1}\" text-anchor=\"middle\" font-size=\"13\" \
             transform=\"rotate(-90 22 {center:.1})\">wrong pixels of a million</text>\n</svg>\n",
            height - 18.0
        )
    }
}

impl Panel {
    /// Its title, and its background.
    fn frame(&self, title: &str) -> String {
        let &Self { x, floor, .. } = self;
        // Long names, such as paths, keep their ends.
        let length = title.chars().count();
        let title: String = if length > 40 {
            format!("...{}", title.chars().skip(length - 37).collect::<String>())
        } else {
            title.into()
        };
        format!(
            "<text x=\"{x:.1}\" y=\"{:.1}\" font-weight=\"bold\">{}</text>\n\
             <rect x=\"{x:.1}\" y=\"{:.1}\" width=\"{WIDE}\" height=\"{HIGH}\" fill=\"#fafafa\" \
             stroke=\"#999999\"/>\n",
            floor - HIGH - 7.0,
            escaped(&title),
            floor - HIGH
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_numbers() {
        assert_eq!(decades([0.0, 5.0, 2e4].into_iter()), Some([0, 5]));
        assert_eq!(decades([10.0].into_iter()), Some([1, 2]));
        assert_eq!(decades([0.0].into_iter()), None);
        assert_eq!((power(2), power(-1), power(0)), ("100".into(), "0.1".into(), "1".into()));
        assert!(power(6).contains('6'));
    }
}
