//! Decisions in 128-bit integers: for orthographic cameras with rational axes and short numbers, as lattices have them.
//!
//! The formulas are those of [`super::decide`] with `sqrt A` and `sqrt B` integers. Every operation is checked: what does not
//! fit gives `None`, and the caller goes on with integers of any size. Only the last comparison needs 256 bits.

use dashu_int::IBig;

use super::{
    axes::{self, split},
    decide::Ball,
};
use crate::camera::View;

/// The camera's axes in 128 bits.
#[derive(Clone, Debug)]
pub struct Axes {
    d: [i128; 3],
    e: [i128; 3],
    g: [i128; 3],
    /// `A`, `B` and their integer roots.
    a: i128,
    b: i128,
    root_a: i128,
    root_b: i128,
}

impl Axes {
    /// If they are rational and fit.
    pub fn new(axes: &axes::Axes, roots: Option<(&IBig, &IBig)>) -> Option<Self> {
        let number = |value: &IBig| i128::try_from(value.clone()).ok();
        let vector = |v: &axes::Vector| Some([number(&v[0])?, number(&v[1])?, number(&v[2])?]);
        let (root_a, root_b) = roots?;
        Some(Self {
            d: vector(&axes.d)?,
            e: vector(&axes.e)?,
            g: vector(&axes.g)?,
            a: number(&axes.a)?,
            b: number(&axes.b)?,
            root_a: number(root_a)?,
            root_b: number(root_b)?,
        })
    }
}

/// `y = beta -+ sqrt q` of a sphere at a pixel, with `t = y / scale`; see [`super::decide`].
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// `(f.d) sqrt B`.
    pub beta: i128,
    /// `A B` times the square of half the chord.
    pub q: i128,
    /// `sqrt (A B)`.
    pub scale: i128,
}

/// `value / 2^exponent`, if it is an integer of at most 126 bits.
fn integer(value: f64, exponent: i32) -> Option<i128> {
    let (mantissa, own) = split(value);
    if mantissa == 0 {
        return Some(0);
    }
    let shift = u32::try_from(own.checked_sub(exponent)?).ok()?;
    let bits = i64::BITS - mantissa.unsigned_abs().leading_zeros();
    (shift + bits <= 126).then(|| i128::from(mantissa) << shift)
}

/// A length in units of `2^exponent / (2 lcm)`.
pub fn length(value: f64, exponent: i32, lcm: u64) -> Option<i128> {
    integer(value, exponent)?.checked_mul(2 * i128::from(lcm))
}

fn dot(a: [i128; 3], b: [i128; 3]) -> Option<i128> {
    let part = |k: usize| a[k].checked_mul(b[k]);
    part(0)?.checked_add(part(1)?)?.checked_add(part(2)?)
}

impl Site {
    /// Of a sphere at the pixel whose sample point is `odd * pitch / 2`; `lcm` as in [`super::decide::Truth`].
    pub fn new(axes: &Axes, view: &View, lcm: [u64; 3], odd: [i32; 2], ball: Ball, exponent: i32) -> Option<Self> {
        let sample =
            |k: usize, length: f64| integer(length, exponent)?.checked_mul(i128::from(odd[k]) * i128::from(lcm[k + 1]));
        let component = |k: usize| {
            let apart = integer(ball.center[k], exponent)?.checked_sub(integer(view.camera.origin[k], exponent)?)?;
            apart.checked_mul(2 * i128::from(lcm[0]))
        };
        let f = [component(0)?, component(1)?, component(2)?];
        let (sx, sy) = (sample(0, view.pitch_x.length)?, sample(1, view.pitch_y.length)?);
        let r = length(ball.radius, exponent, lcm[0])?;
        let (fd, fe, fg) = (dot(f, axes.d)?, dot(f, axes.e)?, dot(f, axes.g)?);
        let square = |value: i128| value.checked_mul(value);
        let rest = square(r)?.checked_sub(square(sx)?)?.checked_sub(square(sy)?)?.checked_sub(dot(f, f)?)?;
        let scale = axes.root_a.checked_mul(axes.root_b)?;
        let q = square(scale)?
            .checked_mul(rest)?
            .checked_add(axes.b.checked_mul(square(fd)?)?)?
            .checked_add(sx.checked_mul(fe)?.checked_mul(2 * axes.a)?.checked_mul(axes.root_b)?)?
            .checked_add(sy.checked_mul(fg)?.checked_mul(2)?.checked_mul(scale)?)?;
        Some(Self { beta: fd.checked_mul(axes.root_b)?, q, scale })
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
        let product = wide_product(q.unsigned_abs().checked_mul(2)?, p.unsigned_abs().checked_mul(2)?);
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
                            assert_eq!(sign_with_roots(x, s, q, t, p), Some(want(value)), "{x} {s} {q} {t} {p}");
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
                state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
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
                    assert_eq!(got, field.sign_with_roots(&element(x), s, &element(q), t, &element(p)));
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
