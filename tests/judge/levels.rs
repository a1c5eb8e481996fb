//! The whole levels that looks are made of, decided like hits: how steeply a sphere is met, how
//! far away it is between two depths, and how much farther than another that another ray meets.

use std::{cmp::Ordering, ops::Range};

use rayon::prelude::*;

use super::{FIRST_PLACES, Hit, Judge, Ray, Seen, interval::Real};

/// A column and a row of samples.
pub type Place = (u32, u32);

/// The greatest whole number up to `most` of which something holds that holds of all below it, too;
/// 0 if there is none.
fn greatest(most: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut good, mut bad) = (0, most + 1);
    while bad - good > 1 {
        let middle = good.midpoint(bad);
        if holds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// A hit as it is seen along its ray.
struct Along<'a, R> {
    ray: &'a Ray<R>,
    seen: &'a Seen<R>,
    hit: Hit,
}

impl Hit {
    /// The sphere: the first of those with its numbers.
    pub fn sphere(&self) -> usize {
        self.sphere
    }
}

impl Judge {
    /// What is seen at a sample.
    pub fn seen_at(&self, (column, row): Place) -> Option<Hit> {
        let sphere = usize::try_from(self.id(column, row)).ok()?;
        self.hit(column, row, sphere)
    }

    /// What is seen at some samples, row by row from the top.
    pub(super) fn hits(&self, columns: Range<u32>, rows: Range<u32>) -> Vec<Option<Hit>> {
        rows.into_par_iter()
            .flat_map_iter(|row| {
                let candidates = self.in_row(row);
                columns
                    .clone()
                    .map(|column| {
                        let id = self.nearest(column, row, &candidates);
                        let sphere = usize::try_from(id).ok()?;
                        Some(self.hit(column, row, sphere).expect("it is seen there"))
                    })
                    .collect::<Vec<_>>()
            })
            .collect()
    }

    /// The greatest `L` up to 255 with `cos >= L / 256`, where cos is that of the angle between ray
    /// and normal.
    pub fn light(&self, (column, row): Place, hit: Hit) -> u32 {
        let body = self.body(hit.sphere);
        // 65536 chords and up to 65536 squares of diameters.
        let size = self.setting.chord(body).larger(17);
        let quick_ray = self.ray(column, row, ());
        let quick_seen = &self.rough_seen(hit.sphere).clone();
        greatest(255, |level| {
            let quick = self.lit(&Along { ray: &quick_ray, seen: quick_seen, hit }, level, ());
            let sign =
                self.sign(column, row, size, self.setting.degree, quick.sign(), |ray, step| {
                    let places = FIRST_PLACES << step;
                    let seen = &self.seen(hit.sphere, self.axes(step), places);
                    self.lit(&Along { ray, seen, hit }, level, places)
                });
            sign != Ordering::Less
        })
    }

    /// Whether `cos >= level / 256`, as a sign. Half the chord is `r cos` long; its square comes
    /// times `|dir|^2`.
    fn lit<R: Real>(&self, along: &Along<R>, level: u32, places: R::Places) -> R {
        let whole = along.ray.square.times(&along.seen.radius.square());
        let part = R::exact(f64::from(level * level), places).times(&whole);
        let chord = self.crossing(along.ray, along.seen).chord;
        R::exact(65536.0, places).times(&chord).minus(&part)
    }

    /// The greatest `D` up to 256 with `t >= N + (F - N) D / 256`, and 0 before N.
    pub fn cue(&self, (column, row): Place, hit: Hit, planes: [f64; 2]) -> u32 {
        let body = self.body(hit.sphere);
        // 256 of one and 256 of the other.
        let size = self.setting.depth(&[body]).larger(8);
        let quick_ray = self.ray(column, row, ());
        let quick_seen = &self.rough_seen(hit.sphere).clone();
        greatest(256, |level| {
            let quick = Along { ray: &quick_ray, seen: quick_seen, hit };
            let quick = self.beyond(&quick, planes, level, ());
            let values = 2 * self.setting.degree;
            let sign = self.sign(column, row, size, values, quick.sign(), |ray, step| {
                let places = FIRST_PLACES << step;
                let seen = &self.seen(hit.sphere, self.axes(step), places);
                self.beyond(&Along { ray, seen, hit }, planes, level, places)
            });
            sign != Ordering::Less
        })
    }

    /// How far a hit is beyond `((256 - level) N + level F) / 256`, times 256 and the square of the
    /// ray's direction.
    fn beyond<R: Real>(
        &self,
        along: &Along<R>,
        [near, far]: [f64; 2],
        level: u32,
        places: R::Places,
    ) -> R {
        let part = |plane: f64, weight: u32| {
            R::exact(plane, places).times(&R::exact(f64::from(weight), places))
        };
        let plane = part(near, 256 - level).plus(&part(far, level));
        let distance = self.crossing(along.ray, along.seen).at(along.hit.root);
        R::exact(256.0, places).times(&distance).minus(&along.ray.square.times(&plane))
    }

    /// How the distance of `b` less that of `a`, along two rays, compares with a length.
    pub fn gap(&self, a: (Place, Hit), b: (Place, Hit), length: f64) -> Ordering {
        let size = self.setting.gap(&[self.body(a.1.sphere), self.body(b.1.sphere)]);
        let rays = [a.0, b.0].map(|(column, row)| self.ray(column, row, ()));
        let quick = self.farther(
            &Along { ray: &rays[0], seen: self.rough_seen(a.1.sphere), hit: a.1 },
            &Along { ray: &rays[1], seen: self.rough_seen(b.1.sphere), hit: b.1 },
            length,
            (),
        );
        let ((column, row), values) = (a.0, 4 * self.setting.degree);
        self.sign(column, row, size, values, quick.sign(), |ray, step| {
            let places = FIRST_PLACES << step;
            let other = self.ray(b.0.0, b.0.1, places);
            let [seen_a, seen_b] =
                [a, b].map(|(_, hit)| self.seen(hit.sphere, self.axes(step), places));
            self.farther(
                &Along { ray, seen: &seen_a, hit: a.1 },
                &Along { ray: &other, seen: &seen_b, hit: b.1 },
                length,
                places,
            )
        })
    }

    /// How much farther `b` is than `a`, less a length, times the squares of both directions.
    fn farther<R: Real>(&self, a: &Along<R>, b: &Along<R>, length: f64, places: R::Places) -> R {
        let [distance_a, distance_b] =
            [a, b].map(|along| self.crossing(along.ray, along.seen).at(along.hit.root));
        let squares = a.ray.square.times(&b.ray.square);
        distance_b
            .times(&a.ray.square)
            .minus(&distance_a.times(&b.ray.square))
            .minus(&R::exact(length, places).times(&squares))
    }

    /// Quick intervals of a sphere that is the first of its numbers.
    fn rough_seen(&self, sphere: usize) -> &Seen<super::Rough> {
        let k = self.first.binary_search_by_key(&sphere, |f| f.0).expect("a hit is a first one");
        &self.first[k].1
    }
}
