//! Correspondences in fixed lanes, as scoring and refinement read them, and the epipolar residual on them.
//!
//! The squared Sampson error of a matrix `F` is `c^2 / d` with `c = x2' F x1` and
//! `d = (F x1)' M2 (F x1) + (F' x2)' M1 (F' x2)`, where `M = J J'` is the metric of a view: `J` is the Jacobian of the
//! homogeneous point or bearing by the pixel. On a plane with pixels of unit scale `M = diag(1, 1, 0)`.

use nalgebra::Matrix3;

use crate::Real;
use crate::linalg::vec3::dot;
use crate::linalg::{LANES, Lanes};

/// Some numbers of each of four correspondences, side by side.
pub(crate) trait Block<T: Real>: Copy {
    /// All lanes zero.
    fn zero() -> Self;

    /// Copies lane `from` of `source` to lane `to`.
    fn set_lane(&mut self, to: usize, source: &Self, from: usize);

    /// The blocks in a slice of numbers; what does not fill a block is left over.
    fn slice(numbers: &[T]) -> &[Self];

    /// The same, to write.
    fn slice_mut(numbers: &mut [T]) -> &mut [Self];

    /// Writes the numbers of one correspondence.
    fn write_lane(&mut self, to: usize, numbers: &[T]);

    /// The same correspondences, each so many lanes before its place.
    fn turned(&self, by: usize) -> Self;
}

impl<T: Real, const W: usize> Block<T> for [Lanes<T>; W] {
    #[cfg_attr(not(small), inline(always))]
    fn zero() -> Self {
        [[T::ZERO; LANES]; W]
    }

    #[cfg_attr(not(small), inline(always))]
    fn set_lane(&mut self, to: usize, source: &Self, from: usize) {
        for (target, lanes) in self.iter_mut().zip(source) {
            if let (Some(entry), Some(&value)) = (target.get_mut(to), lanes.get(from)) {
                *entry = value;
            }
        }
    }

    fn slice(numbers: &[T]) -> &[Self] {
        numbers.as_chunks::<LANES>().0.as_chunks::<W>().0
    }

    fn slice_mut(numbers: &mut [T]) -> &mut [Self] {
        numbers.as_chunks_mut::<LANES>().0.as_chunks_mut::<W>().0
    }

    #[cfg_attr(not(small), inline(always))]
    fn write_lane(&mut self, to: usize, numbers: &[T]) {
        for (target, &value) in self.iter_mut().zip(numbers) {
            if let Some(entry) = target.get_mut(to) {
                *entry = value;
            }
        }
    }

    fn turned(&self, by: usize) -> Self {
        self.map(|lanes| core::array::from_fn(|l| lanes[(l + by) % LANES]))
    }
}

/// Blocks and how many correspondences they hold; lanes beyond are ignored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockSlice<'a, B> {
    /// The blocks.
    pub(crate) blocks: &'a [B],
    /// How many lanes are filled.
    pub(crate) count: usize,
}

/// Four correspondences under an epipolar constraint.
pub(crate) trait EpipolarBlock<T: Real>: Block<T> {
    /// `(c, d)` of the Sampson error of a lane: `r^2 = c^2 / d`.
    fn residual_of(&self, f: &Matrix3<T>, lane: usize) -> (T, T);

    /// The same of all lanes.
    #[cfg_attr(not(small), inline(always))]
    fn residual(&self, f: &Matrix3<T>) -> (Lanes<T>, Lanes<T>) {
        let (mut c, mut d) = ([T::ZERO; LANES], [T::ZERO; LANES]);
        for l in 0..LANES {
            (c[l], d[l]) = self.residual_of(f, l);
        }
        (c, d)
    }

    /// `c`, `1 / d` and `sqrt(d)` times the gradient of `r` by the entries of `f`, row by row.
    fn gradient(&self, f: &Matrix3<T>, lane: usize) -> (T, T, [T; 9]);

    /// A correspondence in a frame along the translation.
    fn sight(&self, frame: &Frame<T>, lane: usize) -> Sight<T>;

    /// What derivatives of the residual need beside that.
    fn slopes(&self, frame: &Frame<T>, lane: usize, sight: &Sight<T>) -> Slopes<T>;

    /// The points of a lane, if there is one, on the plane z = 1 (x1, y1, x2, y2), and by how much squared distances there are
    /// to be multiplied: 1 on a plane; for bearings what makes distances angles, NaN where one does not meet the plane.
    fn on_planes(&self, lane: usize) -> Option<([T; 4], T)>;

    /// View 1 of these correspondences with view 2 of others: wrong correspondences.
    fn mispaired(&self, other: &Self) -> Self;

    /// The homogeneous points or bearings of a lane, if there is one.
    fn directions(&self, lane: usize) -> Option<([T; 3], [T; 3])>;
}

/// Two views as a frame sees them in which the translation is the third axis: then `c = y x x` has two terms only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<T: Real> {
    /// From blocks' coordinates of view 1: `B' R D1^-1`.
    pub(crate) view1: Matrix3<T>,
    /// Of view 2, transposed: `D2^-1 B`.
    pub(crate) view2: Matrix3<T>,
}

/// A correspondence in a [`Frame`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<T> {
    /// The point of view 1.
    pub(crate) y: [T; 3],
    /// The point of view 2.
    pub(crate) x: [T; 3],
    /// `c`.
    pub(crate) c: T,
    /// `d`.
    pub(crate) d: T,
}

impl<T: Real> Sight<T> {
    /// Of two points, and `d`.
    #[inline(always)]
    fn new(y: [T; 3], x: [T; 3], d: T) -> Self {
        Self { y, x, c: x[1] * y[0] - x[0] * y[1], d }
    }

    /// Whether the point lies in front of both cameras, or its rays are parallel to within noise, so that its depth says
    /// nothing: `parallel_sq` is the squared sine up to which they are.
    #[inline(always)]
    pub(crate) fn in_front(&self, parallel_sq: T) -> bool {
        let ([y0, y1, y2], [x0, x1, x2]) = (self.y, self.x);
        // d1 y + e3 = d2 x, in the least-squares sense: both depths times |y x x|^2.
        let (yy, xx, xy) = (y0 * y0 + y1 * y1, x0 * x0 + x1 * x1, x0 * y0 + x1 * y1);
        let (depth1, depth2) = (xy * x2 - xx * y2, yy * x2 - xy * y2);
        if depth1 > T::ZERO && depth2 > T::ZERO {
            return true;
        }
        let (aa, bb, ab) = (yy + y2 * y2, xx + x2 * x2, xy + x2 * y2);
        aa * bb - ab * ab <= parallel_sq * aa * bb && ab > T::ZERO
    }

    /// The squared distance of the point from view 1 in baselines, top and bottom of a fraction: by the law of sines
    /// `sin^2(e3, x) / sin^2(y, x)`.
    #[inline(always)]
    pub(crate) fn distance_sq(&self) -> [T; 2] {
        let ([y0, y1, y2], [x0, x1, x2]) = (self.y, self.x);
        let (a, b) = (y1 * x2 - y2 * x1, y2 * x0 - y0 * x2);
        let yy = y0 * y0 + y1 * y1 + y2 * y2;
        [(x0 * x0 + x1 * x1) * yy, a * a + b * b + self.c * self.c]
    }

    /// Whether the point is as far from view 1 as the root of so many squared baselines.
    #[inline(always)]
    pub(crate) fn beyond(&self, nearest_sq: T) -> bool {
        let [top, bottom] = self.distance_sq();
        top >= nearest_sq * bottom
    }
}

/// How the residual of a correspondence in a [`Frame`] moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slopes<T> {
    /// `1 / d`; zero where a point lies on both epipoles, which has no residual and no direction to move.
    pub(crate) inverse: T,
    /// `c / d` times the metric's product with the epipolar line of view 1, as a point of view 1.
    pub(crate) z: [T; 3],
    /// The same of view 2.
    pub(crate) a: [T; 3],
}

/// Points of two image planes, in pixels of one common scale around the principal points: x1, y1, x2, y2.
pub(crate) type PlaneBlock<T> = [Lanes<T>; 4];

/// Bearings of two views with the metric of each, for lenses whose image is no plane: f1, f2, then `M = J J'` of
/// view 1 and of view 2 as xx, xy, xz, yy, yz, zz.
pub(crate) type BearingBlock<T> = [Lanes<T>; 18];

/// Zero where a point lies on both epipoles, or as good as.
#[inline(always)]
fn inverse_or_zero<T: Real>(d: T) -> T {
    if d >= T::MIN_POSITIVE { T::ONE / d } else { T::ZERO }
}

/// The epipolar lines in view 1 and view 2 of two points in a frame.
#[inline(always)]
fn plane_lines_of<T: Real>(frame: &Frame<T>, y: &[T; 3], x: &[T; 3]) -> ([T; 2], [T; 2]) {
    let (m, n) = (&frame.view1.data.0, &frame.view2.data.0);
    let l1 = [m[0][0] * x[1] - m[0][1] * x[0], m[1][0] * x[1] - m[1][1] * x[0]];
    let l2 = [n[1][0] * y[0] - n[0][0] * y[1], n[1][1] * y[0] - n[0][1] * y[1]];
    (l1, l2)
}

/// `F x1` and the first two entries of `F' x2` of a lane.
#[inline(always)]
fn plane_lines<T: Real>(block: &PlaneBlock<T>, f: &Matrix3<T>, l: usize) -> ([T; 3], [T; 2]) {
    let m = &f.data.0;
    let (x1, y1, x2, y2) = (block[0][l], block[1][l], block[2][l], block[3][l]);
    let l2 = |i: usize| m[0][i] * x1 + m[1][i] * y1 + m[2][i];
    let l1 = |j: usize| m[j][0] * x2 + m[j][1] * y2 + m[j][2];
    ([l2(0), l2(1), l2(2)], [l1(0), l1(1)])
}

impl<T: Real> EpipolarBlock<T> for PlaneBlock<T> {
    #[inline(always)]
    fn residual_of(&self, f: &Matrix3<T>, l: usize) -> (T, T) {
        let ([a, b, e], [p, q]) = plane_lines(self, f, l);
        (self[2][l] * a + self[3][l] * b + e, (a * a + b * b) + (p * p + q * q))
    }

    #[inline(always)]
    fn gradient(&self, f: &Matrix3<T>, l: usize) -> (T, T, [T; 9]) {
        let (x1, y1, x2, y2) = (self[0][l], self[1][l], self[2][l], self[3][l]);
        let ([a, b, e], [p, q]) = plane_lines(self, f, l);
        let c = x2 * a + y2 * b + e;
        let inverse = inverse_or_zero((a * a + b * b) + (p * p + q * q));
        let k = c * inverse;
        // sqrt(d) dr = x2 x1' - k (M2 l2 x1' + x2 (M1 l1)')
        let (u, v) = (x2 - k * a, y2 - k * b);
        let (s, t) = (k * p, k * q);
        let first = [u * x1 - x2 * s, u * y1 - x2 * t, u];
        let second = [v * x1 - y2 * s, v * y1 - y2 * t, v];
        let ([g0, g1, g2], [g3, g4, g5]) = (first, second);
        (c, inverse, [g0, g1, g2, g3, g4, g5, x1 - s, y1 - t, T::ONE])
    }

    #[cfg_attr(not(small), inline(always))]
    #[cfg_attr(small, inline(never))]
    fn sight(&self, frame: &Frame<T>, lane: usize) -> Sight<T> {
        let (m, n) = (&frame.view1.data.0, &frame.view2.data.0);
        // A lane it is already, which is not seen where this is called.
        let l = lane % LANES;
        let (x1, y1, x2, y2) = (self[0][l], self[1][l], self[2][l], self[3][l]);
        let y = |i: usize| m[0][i] * x1 + m[1][i] * y1 + m[2][i];
        let x = |i: usize| n[i][0] * x2 + n[i][1] * y2 + n[i][2];
        let (y, x) = ([y(0), y(1), y(2)], [x(0), x(1), x(2)]);
        let (l1, l2) = plane_lines_of(frame, &y, &x);
        Sight::new(y, x, (l2[0] * l2[0] + l2[1] * l2[1]) + (l1[0] * l1[0] + l1[1] * l1[1]))
    }

    #[inline(always)]
    fn slopes(&self, frame: &Frame<T>, _: usize, sight: &Sight<T>) -> Slopes<T> {
        let (m, n) = (&frame.view1.data.0, &frame.view2.data.0);
        let (l1, l2) = plane_lines_of(frame, &sight.y, &sight.x);
        let inverse = inverse_or_zero(sight.d);
        let k = sight.c * inverse;
        let (s, t) = ([k * l1[0], k * l1[1]], [k * l2[0], k * l2[1]]);
        let z = |i: usize| m[0][i] * s[0] + m[1][i] * s[1];
        let a = |i: usize| n[i][0] * t[0] + n[i][1] * t[1];
        Slopes { inverse, z: [z(0), z(1), z(2)], a: [a(0), a(1), a(2)] }
    }

    fn mispaired(&self, other: &Self) -> Self {
        [self[0], self[1], other[2], other[3]]
    }

    #[cfg_attr(not(small), inline(always))]
    fn on_planes(&self, lane: usize) -> Option<([T; 4], T)> {
        let at = |k: usize| self[k].get(lane).copied();
        Some(([at(0)?, at(1)?, at(2)?, at(3)?], T::ONE))
    }

    #[cfg_attr(not(small), inline(always))]
    fn directions(&self, lane: usize) -> Option<([T; 3], [T; 3])> {
        let at = |k: usize| self[k].get(lane).copied();
        Some(([at(0)?, at(1)?, T::ONE], [at(2)?, at(3)?, T::ONE]))
    }
}

/// `(f1, f2, l1 = F' f2, l2 = F f1)` of a lane. Inlined, so that the lane is known to be one.
#[inline(always)]
fn lines<T: Real>(block: &BearingBlock<T>, f: &Matrix3<T>, l: usize) -> ([T; 3], [T; 3], [T; 3], [T; 3]) {
    let m = &f.data.0;
    let f1 = [block[0][l], block[1][l], block[2][l]];
    let f2 = [block[3][l], block[4][l], block[5][l]];
    let l1 = [dot(&m[0], &f2), dot(&m[1], &f2), dot(&m[2], &f2)];
    let row = |i: usize| m[0][i] * f1[0] + m[1][i] * f1[1] + m[2][i] * f1[2];
    (f1, f2, l1, [row(0), row(1), row(2)])
}

/// The products of both metrics with the epipolar lines.
#[inline(always)]
fn metrics<T: Real>(block: &BearingBlock<T>, l: usize, l1: &[T; 3], l2: &[T; 3]) -> ([T; 3], [T; 3]) {
    let b = block;
    let (xx, xy, xz, yy, yz, zz) = (b[6][l], b[7][l], b[8][l], b[9][l], b[10][l], b[11][l]);
    let n1 = [dot(&[xx, xy, xz], l1), dot(&[xy, yy, yz], l1), dot(&[xz, yz, zz], l1)];
    let (xx, xy, xz, yy, yz, zz) = (b[12][l], b[13][l], b[14][l], b[15][l], b[16][l], b[17][l]);
    let n2 = [dot(&[xx, xy, xz], l2), dot(&[xy, yy, yz], l2), dot(&[xz, yz, zz], l2)];
    (n1, n2)
}

/// A vector of view 1 in a frame.
#[inline(always)]
fn turned1<T: Real>(frame: &Frame<T>, v: &[T; 3]) -> [T; 3] {
    let m = &frame.view1.data.0;
    let row = |i: usize| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2];
    [row(0), row(1), row(2)]
}

/// A vector of view 2 in a frame.
#[inline(always)]
fn turned2<T: Real>(frame: &Frame<T>, v: &[T; 3]) -> [T; 3] {
    let n = &frame.view2.data.0;
    [dot(&n[0], v), dot(&n[1], v), dot(&n[2], v)]
}

/// The epipolar lines in view 1 and view 2 of two bearings in a frame.
#[inline(always)]
fn bearing_lines<T: Real>(frame: &Frame<T>, y: &[T; 3], x: &[T; 3]) -> ([T; 3], [T; 3]) {
    let (m, n) = (&frame.view1.data.0, &frame.view2.data.0);
    let l1 = |j: usize| m[j][0] * x[1] - m[j][1] * x[0];
    let l2 = |i: usize| n[1][i] * y[0] - n[0][i] * y[1];
    ([l1(0), l1(1), l1(2)], [l2(0), l2(1), l2(2)])
}

impl<T: Real> EpipolarBlock<T> for BearingBlock<T> {
    #[inline(always)]
    fn residual_of(&self, f: &Matrix3<T>, l: usize) -> (T, T) {
        let (_, f2, l1, l2) = lines(self, f, l);
        let (n1, n2) = metrics(self, l, &l1, &l2);
        (dot(&f2, &l2), dot(&l2, &n2) + dot(&l1, &n1))
    }

    #[inline(always)]
    fn gradient(&self, f: &Matrix3<T>, l: usize) -> (T, T, [T; 9]) {
        let (f1, f2, l1, l2) = lines(self, f, l);
        let (n1, n2) = metrics(self, l, &l1, &l2);
        let c = dot(&f2, &l2);
        let inverse = inverse_or_zero(dot(&l2, &n2) + dot(&l1, &n1));
        let k = c * inverse;
        let mut g = [T::ZERO; 9];
        for i in 0..3 {
            let u = f2[i] - k * n2[i];
            for j in 0..3 {
                g[3 * i + j] = u * f1[j] - f2[i] * (k * n1[j]);
            }
        }
        (c, inverse, g)
    }

    #[inline(always)]
    fn sight(&self, frame: &Frame<T>, l: usize) -> Sight<T> {
        let y = turned1(frame, &[self[0][l], self[1][l], self[2][l]]);
        let x = turned2(frame, &[self[3][l], self[4][l], self[5][l]]);
        let (l1, l2) = bearing_lines(frame, &y, &x);
        let (n1, n2) = metrics(self, l, &l1, &l2);
        Sight::new(y, x, dot(&l2, &n2) + dot(&l1, &n1))
    }

    #[inline(always)]
    fn slopes(&self, frame: &Frame<T>, l: usize, sight: &Sight<T>) -> Slopes<T> {
        let (l1, l2) = bearing_lines(frame, &sight.y, &sight.x);
        let (n1, n2) = metrics(self, l, &l1, &l2);
        let inverse = inverse_or_zero(sight.d);
        let k = sight.c * inverse;
        let (z, a) = (turned1(frame, &n1), turned2(frame, &n2));
        Slopes { inverse, z: z.map(|z| k * z), a: a.map(|a| k * a) }
    }

    fn mispaired(&self, other: &Self) -> Self {
        let mut block = *other;
        for (k, (own, value)) in block.iter_mut().zip(self).enumerate() {
            if !(3..6).contains(&k) {
                *own = *value;
            }
        }
        block
    }

    #[cfg_attr(not(small), inline(always))]
    fn on_planes(&self, lane: usize) -> Option<([T; 4], T)> {
        let ([x1, y1, z1], [x2, y2, z2]) = self.directions(lane)?;
        let (a, b) = (T::ONE / z1, T::ONE / z2);
        // A distance on the plane is an angle over cos^2 along the radius: the product of both views' cosines.
        let cosines = z1 * z2;
        let ahead = z1 > T::ZERO && z2 > T::ZERO;
        let weight = if ahead { cosines * cosines } else { crate::real::lit(f64::NAN) };
        Some(([x1 * a, y1 * a, x2 * b, y2 * b], weight))
    }

    #[cfg_attr(not(small), inline(always))]
    fn directions(&self, lane: usize) -> Option<([T; 3], [T; 3])> {
        let at = |k: usize| self[k].get(lane).copied();
        Some(([at(0)?, at(1)?, at(2)?], [at(3)?, at(4)?, at(5)?]))
    }
}
