//! Exact numbers `x0 + x1 sqrt A + x2 sqrt B + x3 sqrt(A B)` with integer coefficients, and their
//! signs.
//!
//! The squared lengths `A` and `B` belong to the camera's axes ([`crate::axes`]). Where one is a
//! perfect square its root is an integer and is folded away at once, so that axis-aligned cameras
//! compute in plain integers. Signs are decided by squaring: `sign(x + y sqrt Q)` is the common
//! sign of the terms, or else the sign of `x` times that of `x^2 - y^2 Q`. This holds whether or
//! not the roots are independent.

use dashu_int::{IBig, Sign, UBig, ops::SquareRoot};

/// Coefficients of 1, sqrt A, sqrt B, sqrt(A B).
#[derive(Clone, Debug, PartialEq)]
pub struct Element(pub [IBig; 4]);

impl Element {
    /// An integer.
    pub fn integer(value: IBig) -> Self {
        Self([value, IBig::ZERO, IBig::ZERO, IBig::ZERO])
    }

    fn is_integer(&self) -> bool {
        self.0[1..].iter().all(IBig::is_zero)
    }

    /// Sum.
    pub fn plus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|k| &self.0[k] + &other.0[k]))
    }

    /// Difference.
    pub fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|k| &self.0[k] - &other.0[k]))
    }

    /// Product with an integer.
    pub fn times_integer(&self, factor: &IBig) -> Self {
        Self(std::array::from_fn(|k| &self.0[k] * factor))
    }
}

/// The sign of an integer: -1, 0 or 1.
pub fn sign_of(value: &IBig) -> i32 {
    match value.sign() {
        _ if value.is_zero() => 0,
        Sign::Positive => 1,
        Sign::Negative => -1,
    }
}

/// The sign of `x + y sqrt Q`, given the signs of `x` and `y sqrt Q` and how to get that of `x^2 -
/// y^2 Q`.
fn sign_of_sum(x: i32, root_term: i32, squares: impl FnOnce() -> i32) -> i32 {
    if x == 0 || x == root_term {
        root_term
    } else if root_term == 0 {
        x
    } else {
        x * squares()
    }
}

/// The field: which roots it holds.
#[derive(Clone, Debug)]
pub struct Field {
    a: IBig,
    b: IBig,
    root_a: Option<IBig>,
    root_b: Option<IBig>,
}

/// The square root of a perfect square.
fn perfect_root(square: &IBig) -> Option<IBig> {
    let square = UBig::try_from(square.clone()).ok()?;
    let root = square.sqrt();
    (root.sqr() == square).then(|| IBig::from(root))
}

impl Field {
    /// With the square roots of positive integers `a` and `b`.
    pub fn new(a: &IBig, b: &IBig) -> Self {
        Self { a: a.clone(), b: b.clone(), root_a: perfect_root(a), root_b: perfect_root(b) }
    }

    /// The square roots of `a` and `b` that are integers.
    pub fn roots(&self) -> [Option<&IBig>; 2] {
        [self.root_a.as_ref(), self.root_b.as_ref()]
    }

    /// An element from its coefficients, with the roots that are integers folded away.
    pub fn element(&self, x: [IBig; 4]) -> Element {
        let [mut x0, mut x1, mut x2, mut x3] = x;
        if let Some(root) = &self.root_a {
            x0 += root * std::mem::take(&mut x1);
            x2 += root * std::mem::take(&mut x3);
        }
        if let Some(root) = &self.root_b {
            x0 += root * std::mem::take(&mut x2);
            x1 += root * std::mem::take(&mut x3);
        }
        Element([x0, x1, x2, x3])
    }

    /// Product.
    pub fn product(&self, x: &Element, y: &Element) -> Element {
        if x.is_integer() {
            return y.times_integer(&x.0[0]);
        }
        if y.is_integer() {
            return x.times_integer(&y.0[0]);
        }
        let ([x0, x1, x2, x3], [y0, y1, y2, y3]) = (&x.0, &y.0);
        let (a, b) = (&self.a, &self.b);
        Element([
            x0 * y0 + a * (x1 * y1) + b * (x2 * y2 + a * (x3 * y3)),
            x0 * y1 + x1 * y0 + b * (x2 * y3 + x3 * y2),
            x0 * y2 + x2 * y0 + a * (x1 * y3 + x3 * y1),
            x0 * y3 + x3 * y0 + x1 * y2 + x2 * y1,
        ])
    }

    /// The sign of `x + y sqrt A`.
    fn sign_over_a(&self, x: &IBig, y: &IBig) -> i32 {
        sign_of_sum(sign_of(x), sign_of(y), || sign_of(&(x * x - y * y * &self.a)))
    }

    /// The sign of an element.
    pub fn sign(&self, x: &Element) -> i32 {
        let [x0, x1, x2, x3] = &x.0;
        if x.is_integer() {
            return sign_of(x0);
        }
        // (x0 + x1 sqrt A) + (x2 + x3 sqrt A) sqrt B
        sign_of_sum(self.sign_over_a(x0, x1), self.sign_over_a(x2, x3), || {
            let (a, b) = (&self.a, &self.b);
            let whole = x0 * x0 + a * (x1 * x1) - b * (x2 * x2 + a * (x3 * x3));
            let over_a = IBig::from(2) * (x0 * x1 - b * (x2 * x3));
            self.sign_over_a(&whole, &over_a)
        })
    }

    /// The sign of `x + s sqrt q`, for `q >= 0` and `s` one of -1, 0, 1.
    pub fn sign_with_root(&self, x: &Element, s: i32, q: &Element) -> i32 {
        let root_term = s * self.sign(q);
        sign_of_sum(self.sign(x), root_term, || self.sign(&self.product(x, x).minus(q)))
    }

    /// The sign of `x + s sqrt q - t sqrt p`, for `q, p >= 0` and `s`, `t` one of -1, 1.
    pub fn sign_with_roots(&self, x: &Element, s: i32, q: &Element, t: i32, p: &Element) -> i32 {
        let (q_sign, p_sign) = (self.sign(q), self.sign(p));
        // The sign of the two roots together, S = s sqrt q - t sqrt p.
        let roots = match (s * q_sign, -t * p_sign) {
            (0, other) | (other, 0) => other,
            (one, other) if one == other => one,
            (one, _) => one * self.sign(&q.minus(p)),
        };
        sign_of_sum(self.sign(x), roots, || {
            // x^2 - S^2 = (x^2 - q - p) + 2 s t sqrt(q p)
            let rest = self.product(x, x).minus(q).minus(p);
            let product = self.product(q, p).times_integer(&IBig::from(4));
            self.sign_with_root(&rest, s * t, &product)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn big(values: [i64; 4]) -> [IBig; 4] {
        values.map(IBig::from)
    }

    /// All small elements of several fields against f64, and where f64 is in doubt against
    /// independent identities.
    #[test]
    fn signs_are_right_on_all_small_elements() {
        for (a, b) in [(2, 3), (4, 3), (2, 9), (1, 1), (2, 8), (5, 20), (6, 6)] {
            let field = Field::new(&IBig::from(a), &IBig::from(b));
            let (ra, rb) = ((a as f64).sqrt(), (b as f64).sqrt());
            let range = -4..=4;
            for x0 in range.clone() {
                for x1 in range.clone() {
                    for x2 in range.clone() {
                        for x3 in range.clone() {
                            let x = field.element(big([x0, x1, x2, x3]));
                            let value =
                                x0 as f64 + x1 as f64 * ra + x2 as f64 * rb + x3 as f64 * ra * rb;
                            // Elements this small are zero or at least 1e-5 in size: norms are
                            // integers.
                            let want = if value.abs() < 1e-9 { 0 } else { value.signum() as i32 };
                            assert_eq!(field.sign(&x), want, "{x0} {x1} {x2} {x3} over {a} {b}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn products_agree_with_numbers() {
        let field = Field::new(&IBig::from(2), &IBig::from(3));
        let value = |x: &Element| {
            let c = x.0.each_ref().map(|c| c.to_f64().value());
            c[0] + c[1] * 2f64.sqrt() + c[2] * 3f64.sqrt() + c[3] * 6f64.sqrt()
        };
        let (x, y) = (field.element(big([1, -2, 3, 5])), field.element(big([-7, 2, 1, -1])));
        assert!((value(&field.product(&x, &y)) - value(&x) * value(&y)).abs() < 1e-9);
    }

    /// sign(x + s sqrt q - t sqrt p) on all 4-bit integers, ties included.
    #[test]
    fn signs_with_roots_are_exhaustive_on_four_bits() {
        let field = Field::new(&IBig::from(1), &IBig::from(1));
        let element = |v: i64| Element::integer(IBig::from(v));
        for x in -8..8 {
            for q in 0..16 {
                for p in 0..16 {
                    for (s, t) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
                        let value =
                            x as f64 + s as f64 * (q as f64).sqrt() - t as f64 * (p as f64).sqrt();
                        let want = if value.abs() < 1e-9 { 0 } else { value.signum() as i32 };
                        let got =
                            field.sign_with_roots(&element(x), s, &element(q), t, &element(p));
                        assert_eq!(got, want, "{x} {s} sqrt {q} - {t} sqrt {p}");
                    }
                }
            }
        }
    }
}
