use epipole::estimate::*;
use epipole::nalgebra::{Matrix3, Vector2, Vector3};
struct R(u64);
impl R {
    fn u(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 11) as f64) / (1u64 << 53) as f64
    }
    fn n(&mut self) -> f64 {
        (-2.0 * (1.0 - self.u()).ln()).sqrt() * (6.283185307179586 * self.u()).cos()
    }
}
fn main() {
    let what = std::env::args().nth(1).unwrap();
    for outl in [0.1, 0.5, 0.7] {
        let (mut it, mut rf, mut hyp, mut res, mut t, mut found) = (0, 0, 0, 0u64, vec![], 0);
        for seed in 0..60u64 {
            let mut r = R(seed * 7919 + 13);
            for _ in 0..10 {
                r.u();
            }
            let n = 200;
            let h = Matrix3::new(
                1.0 + 0.1 * r.n(),
                0.1 * r.n(),
                60.0 * r.n(),
                0.1 * r.n(),
                1.0 + 0.1 * r.n(),
                30.0 * r.n(),
                1e-4 * r.n(),
                1e-4 * r.n(),
                1.0,
            );
            let (mut x1, mut x2) = (vec![], vec![]);
            let k = Vector2::new(620.0, 188.0);
            for i in 0..n {
                let p = Vector2::new(r.u() * 1241.0, r.u() * 376.0);
                let q = if what == "h" {
                    let y = h * Vector3::new(p.x, p.y, 1.0);
                    Vector2::new(y.x / y.z, y.y / y.z)
                } else {
                    let z = 4.0 + 16.0 * r.u();
                    let x = Vector3::new((p.x - k.x) / 718.0 * z, (p.y - k.y) / 718.0 * z, z);
                    let y = epipole::nalgebra::Rotation3::from_euler_angles(0.1, -0.05, 0.08) * x
                        + Vector3::new(1.0, 0.2, 0.3);
                    Vector2::new(y.x / y.z * 718.0 + k.x, y.y / y.z * 718.0 + k.y)
                };
                let q = if (i as f64) < outl * n as f64 {
                    Vector2::new(r.u() * 1241.0, r.u() * 376.0)
                } else {
                    q + Vector2::new(r.n(), r.n())
                };
                x1.push(p + Vector2::new(r.n(), r.n()));
                x2.push(q);
            }
            let mut st = TwoViewStorage::<f64, 200>::new();
            let mut ws = st.workspace();
            let mut best = f64::MAX;
            let mut rep = None;
            for _ in 0..3 {
                let s = std::time::Instant::now();
                let r = if what == "h" {
                    let mut o = HomographyOptions::default();
                    o.max_error_px = 4.0;
                    let e = homography(&x1, &x2, &o, &mut ws).unwrap();
                    (e.report, e.homography().is_some())
                } else {
                    let mut o = FundamentalOptions::default();
                    o.max_error_px = 2.0;
                    let e = fundamental(&x1, &x2, &o, &mut ws).unwrap();
                    (e.report, e.fundamental().is_some())
                };
                best = best.min(s.elapsed().as_secs_f64());
                rep = Some(r);
            }
            let (rep, f) = rep.unwrap();
            it += rep.spent.iterations;
            rf += rep.spent.refinements;
            hyp += rep.spent.hypotheses;
            res += rep.spent.residuals;
            found += f as u32;
            t.push(best * 1e3);
        }
        t.sort_by(f64::total_cmp);
        println!(
            "{what} {outl}: iters {} refinements {:.1} hypotheses {} residuals/N {:.0} found {found} ms median {:.3} mean {:.3}",
            it / 60,
            rf as f64 / 60.0,
            hyp / 60,
            res as f64 / 60.0 / 200.0,
            t[30],
            t.iter().sum::<f64>() / 60.0
        );
    }
}
