//! Decisions in 128-bit integers: for orthographic cameras and short numbers, as lattices have
//! them.
//!
//! The formulas are those of [`super::decide`] with `sqrt A` and `sqrt B` integers. Where these are
//! not, ties by symmetry are told all the same. What does not fit, by a limit on lengths or a
//! check, gives `None`, and the caller goes on with other arithmetic. Only the last comparison
//! needs 256 bits.

use dashu_int::IBig;

use crate::{axes, camera::View, scene::Ball};

/// How many bits below the largest length of a scene the unit lies.
const BITS: i32 = 36;

/// A view in integers: lengths in units of `2^exponent / (2 lcm)`, as in [`super::decide`].
#[derive(Clone, Debug)]
pub struct Frame {
    d: [i64; 3],
    e: [i64; 3],
    g: [i64; 3],
    a: i128,
    b: i128,
    /// Of `A`, `B` and their product, where they are integers.
    roots: [Option<i128>; 3],
    /// `2^-exponent`.
    per_unit: f64,
    /// `2 lcm`.
    parts: i64,
    /// Lengths below this keep every sum of [`Frame::site`] inside its type.
    limit: i64,
    /// In units of `2^exponent`.
    origin: [i64; 3],
    /// Half a pixel each way.
    half_pixel: [i64; 2],
}

/// `y = beta -+ sqrt q` of a sphere at a pixel, with `t = y / sqrt(A B)`; see [`super::decide`].
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// `(f.d) sqrt B`.
    pub beta: i128,
    /// `q - A B r^2`, which needs no radius.
    pub apart: i128,
    /// `A B` times the square of half the chord; none if the radius does not fit.
    pub q: Option<i128>,
}

/// The sign of `y_1 - y_2` for the roots `s` and `t` (-1 or 1) of two spheres.
pub fn order(one: &Site, s: i32, other: &Site, t: i32, same_radius: bool) -> Option<i32> {
    if same_radius && s == t && one.beta == other.beta {
        // s (sqrt q_1 - sqrt q_2), and the radius drops out: the true ties of lattices, whatever
        // the radius.
        return Some(s * sign(one.apart.checked_sub(other.apart)?));
    }
    sign_with_roots(one.beta.checked_sub(other.beta)?, s, one.q?, t, other.q?)
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn square(value: i64) -> i128 {
    i128::from(value) * i128::from(value)
}

impl Frame {
    /// If everything fits; `roots` are those of `A` and `B` that are integers, `lcm` as in
    /// [`super::decide::Truth`], `largest` the exponent of the largest length.
    pub fn new(
        axes: &axes::Axes,
        roots: [Option<&IBig>; 2],
        view: &View,
        lcm: [u64; 3],
        largest: i32,
    ) -> Option<Self> {
        let number = |value: &IBig| i64::try_from(value.clone()).ok();
        let vector = |v: &axes::Vector| Some([number(&v[0])?, number(&v[1])?, number(&v[2])?]);
        let (d, e, g) = (vector(&axes.d)?, vector(&axes.e)?, vector(&axes.g)?);
        let (a, b) = (number(&axes.a)?, number(&axes.b)?);
        let product = i128::from(a) * i128::from(b);
        let root_ab = product.isqrt();
        let [root_a, root_b] = roots.map(|root| root.and_then(number).map(i128::from));
        let roots = [root_a, root_b, (root_ab * root_ab == product).then_some(root_ab)];
        // Dot products stay within an i64, and sums of `site` below 2^126: lemma X4.
        let bits = |value: i64| 64 - value.unsigned_abs().leading_zeros() as i32;
        let component = d.into_iter().chain(e).chain(g).map(bits).max()?;
        let length = (60 - component).min((118 - 2 * component - bits(a) - bits(b)) / 2);
        let mut frame = Self {
            d,
            e,
            g,
            a: a.into(),
            b: b.into(),
            roots,
            per_unit: axes::scaled(1.0, BITS - largest),
            parts: 2 * i64::try_from(lcm[0]).ok()?,
            limit: if (1..60).contains(&length) { 1 << length } else { return None },
            origin: [0; 3],
            half_pixel: [0; 2],
        };
        if !frame.per_unit.is_normal() {
            return None;
        }
        for (k, coordinate) in view.camera.origin.to_array().into_iter().enumerate() {
            frame.origin[k] = frame.integer(coordinate)?;
        }
        for (k, length) in [view.pitch_x.length, view.pitch_y.length].into_iter().enumerate() {
            frame.half_pixel[k] =
                frame.integer(length)?.checked_mul(i64::try_from(lcm[k + 1]).ok()?)?;
        }
        Some(frame)
    }

    /// A length in units of `2^exponent`, if it is an integer of at most 53 bits.
    fn integer(&self, value: f64) -> Option<i64> {
        // A power of two: exact, unless it underflows, and then it is not an integer either.
        let units = value * self.per_unit;
        let whole = units as i64;
        (whole as f64 == units && units.abs() < 9.0e15 && (whole != 0 || value == 0.0))
            .then_some(whole)
    }

    /// A product of lengths' parts that keeps below the limit.
    fn within(&self, value: i64, parts: i64) -> Option<i64> {
        value.checked_mul(parts).filter(|length| length.abs() < self.limit)
    }

    /// `plane * sqrt(A B)`, to compare with `y`.
    pub fn plane(&self, distance: f64) -> Option<i128> {
        let [_, _, root_ab] = self.rational()?;
        i128::from(self.integer(distance)?.checked_mul(self.parts)?).checked_mul(root_ab)
    }

    /// The roots, if all are integers.
    fn rational(&self) -> Option<[i128; 3]> {
        let [a, b, ab] = self.roots;
        Some([a?, b?, ab?])
    }

    /// A centre relative to the camera, and the sample point `odd` half pixels from the middle.
    fn place(&self, odd: [i32; 2], ball: Ball) -> Option<([i64; 3], [i64; 2])> {
        let component =
            |k: usize| self.within(self.integer(ball.center[k])? - self.origin[k], self.parts);
        let f = [component(0)?, component(1)?, component(2)?];
        let sample = |k: usize| self.within(self.half_pixel[k], odd[k].into());
        Some((f, [sample(0)?, sample(1)?]))
    }

    /// A sphere at the pixel whose sample point is `odd` half pixels from the middle, where all
    /// roots are integers.
    pub fn site(&self, odd: [i32; 2], ball: Ball) -> Option<Site> {
        let [_, root_b, root_ab] = self.rational()?;
        let (f, [sx, sy]) = self.place(odd, ball)?;
        let (fd, fe, fg) = (dot(f, self.d), dot(f, self.e), dot(f, self.g));
        let rest = square(sx) + square(sy) + square(f[0]) + square(f[1]) + square(f[2]);
        let along_x = i128::from(sx) * i128::from(fe) * self.a * root_b;
        let along_y = i128::from(sy) * i128::from(fg) * root_ab;
        let apart = self.b * square(fd) + 2 * (along_x + along_y) - self.a * self.b * rest;
        let radius = self.integer(ball.radius).and_then(|radius| self.within(radius, self.parts));
        let q = radius.map(|radius| apart + self.a * self.b * square(radius));
        Some(Site { beta: i128::from(fd) * root_b, apart, q })
    }

    /// Whether two spheres of one radius are symmetrical about the ray's plane or the like, and so
    /// equally deep at a pixel: `beta` and `q` are equal. True ties of lattices are told by this
    /// whatever the axes.
    pub fn symmetrical(&self, odd: [i32; 2], one: Ball, other: Ball) -> Option<bool> {
        let ((f, [sx, sy]), (h, _)) = (self.place(odd, one)?, self.place(odd, other)?);
        if dot(f, self.d) != dot(h, self.d) {
            return Some(false);
        }
        // With beta, what is left of q_1 - q_2 is -p + x sqrt B + y sqrt(A B).
        let apart = |v: [i64; 3]| square(v[0]) + square(v[1]) + square(v[2]);
        let p = self.a * self.b * (apart(f) - apart(h));
        let x = 2 * i128::from(sx) * i128::from(dot(f, self.e) - dot(h, self.e)) * self.a;
        let y = 2 * i128::from(sy) * i128::from(dot(f, self.g) - dot(h, self.g));
        // Roots that are not integers are independent of 1, and those of B and A B of each other
        // unless that of A is an integer.
        Some(match self.roots {
            [_, Some(root_b), Some(root_ab)] => x * root_b + y * root_ab == p,
            [_, Some(root_b), None] => x * root_b == p && y == 0,
            [_, None, Some(root_ab)] => y * root_ab == p && x == 0,
            [Some(root_a), None, None] => p == 0 && x + y * root_a == 0,
            [None, None, None] => p == 0 && x == 0 && y == 0,
        })
    }
}

fn sign(value: i128) -> i32 {
    value.signum() as i32
}

/// The product of two numbers as (high, low) 128-bit halves.
fn wide_product(a: u128, b: u128) -> (u128, u128) {
    const HALF: u128 = u64::MAX as u128;
    let ((a1, a0), (b1, b0)) = ((a >> 64, a & HALF), (b >> 64, b & HALF));
    let low = a0 * b0;
    let middle = a1 * b0 + (low >> 64);
    let cross = a0 * b1 + (middle & HALF);
    (a1 * b1 + (middle >> 64) + (cross >> 64), cross << 64 | low & HALF)
}

/// The sign of `x + s sqrt q`, `q >= 0`.
pub fn sign_with_root(x: i128, s: i32, q: i128) -> Option<i32> {
    let root = s * sign(q);
    if x == 0 || sign(x) == root {
        return Some(root);
    }
    if root == 0 {
        return Some(sign(x));
    }
    let squares = x.unsigned_abs().checked_mul(x.unsigned_abs())?.cmp(&q.unsigned_abs());
    Some(sign(x) * squares as i32)
}

/// The sign of `x + s sqrt q - t sqrt p`, `q, p >= 0`, `s` and `t` one of -1, 1.
pub fn sign_with_roots(x: i128, s: i32, q: i128, t: i32, p: i128) -> Option<i32> {
    let roots = match (s * sign(q), -t * sign(p)) {
        (0, other) | (other, 0) => other,
        (one, other) if one == other => one,
        (one, _) => one * sign(q - p),
    };
    if x == 0 || sign(x) == roots {
        return Some(roots);
    }
    if roots == 0 {
        return Some(sign(x));
    }
    // x^2 - (s sqrt q - t sqrt p)^2 = rest + 2 s t sqrt(q p)
    let rest = x.checked_mul(x)?.checked_sub(q)?.checked_sub(p)?;
    let root = s * t * sign(q) * sign(p);
    let squares = if rest == 0 || sign(rest) == root {
        root
    } else if root == 0 {
        sign(rest)
    } else {
        let product =
            wide_product(q.unsigned_abs().checked_mul(2)?, p.unsigned_abs().checked_mul(2)?);
        let square = wide_product(rest.unsigned_abs(), rest.unsigned_abs());
        sign(rest) * square.cmp(&product) as i32
    };
    Some(sign(x) * squares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::field::{Element, Field};

    #[test]
    fn exhaustive_on_four_bits() {
        for x in -8..8 {
            for q in 0..16 {
                let value = |s: i32| x as f64 + f64::from(s) * (q as f64).sqrt();
                let want = |value: f64| if value.abs() < 1e-9 { 0 } else { value.signum() as i32 };
                for s in [-1, 1] {
                    assert_eq!(sign_with_root(x, s, q), Some(want(value(s))));
                    for p in 0..16 {
                        for t in [-1, 1] {
                            let value = value(s) - f64::from(t) * (p as f64).sqrt();
                            assert_eq!(
                                sign_with_roots(x, s, q, t, p),
                                Some(want(value)),
                                "{x} {s} {q} {t} {p}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn agrees_with_big_integers_up_to_the_full_range() {
        let field = Field::new(&IBig::ONE, &IBig::ONE);
        let mut state = 3u64;
        let mut random = |bits: u32| {
            let mut value = 0i128;
            for _ in 0..2 {
                state =
                    state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
                value = value << 64 | i128::from(state ^ state >> 29);
            }
            (value & i128::MAX) >> (127 - bits)
        };
        let mut told = 0;
        for round in 0..40_000u32 {
            let bits = 2 + round % 125;
            let (q, p) = (random(bits), random(bits - round % 2));
            // Near the edge as often as not: x close to the difference of the roots.
            let edge = (q as f64).sqrt() - (p as f64).sqrt();
            let x = edge as i128 + random(2) - 2;
            for (s, t) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let element = |v: i128| Element::integer(IBig::from(v));
                if let Some(got) = sign_with_roots(x, s, q, t, p) {
                    told += 1;
                    assert_eq!(
                        got,
                        field.sign_with_roots(&element(x), s, &element(q), t, &element(p))
                    );
                }
                if let Some(got) = sign_with_root(x, s, q) {
                    assert_eq!(got, field.sign_with_root(&element(x), s, &element(q)));
                }
            }
        }
        assert!(told > 100_000, "{told}");
        for (a, b) in [(random(127) as u128, random(127) as u128), (u128::MAX, u128::MAX)] {
            let (high, low) = wide_product(a, b);
            assert_eq!((IBig::from(high) << 128) + IBig::from(low), IBig::from(a) * IBig::from(b));
        }
    }
}
