//! What every capability answers, hashed bit by bit, and the hashes that are right.
//!
//! A capability is asked twice: on problems that have a solution (`problem ...`), and on arguments of any bits
//! (`any bits ...`). The committed hashes are the host's; every target must find the same.

use core::marker::PhantomData;

use epipole::Real;
use epipole_exercise::{CAPABILITIES, Sink, Source};

mod estimate;
mod geometry;
mod solvers;
mod window;

/// The committed hashes: a line for each capability and scalar.
pub const COMMITTED: &str = include_str!("../../../golden/bits.txt");

/// The versions of nalgebra and libm that the hashes were found with, and must also be found with.
pub const VERSIONS: &str = concat!("nalgebra ", env!("NALGEBRA_VERSION"), ", libm ", env!("LIBM_VERSION"));

/// How many random arguments a capability is called with.
const ANY_BITS: u64 = 128;

/// One capability on problems that have a solution.
struct Problem {
    name: &'static str,
    call: fn(&mut Sink),
}

/// The problems in one scalar, so that a program which asks in `f32` alone holds no code in `f64`.
struct Problems<T>(PhantomData<T>);

macro_rules! problems {
    ($table:ident; $($module:ident: $($function:ident)*;)*) => {
        impl<T: Real> Problems<T> {
            const $table: &[Problem] = &[$($(Problem {
                name: concat!(stringify!($module), "::", stringify!($function)),
                call: $module::$function::<T>,
            },)*)*];
        }
    };
}

problems! { MINIMAL;
    solvers: relpose_5pt relpose_7pt relpose_8pt relpose_upright_3pt homography p3p abspose_upright_2pt abspose_npt
        abspose_planar resection rotation translation absolute_orientation;
    geometry: cameras poses motions_of_matrices triangulation residuals decompositions;
}
problems! { ROBUST;
    estimate: relative_pose_of_views homography_of_plane fundamental_of_views absolute_pose_of_points refine;
    window: bundle;
}

/// What one capability answered.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// `problem` or `any bits`, and what was called.
    pub kind: &'static str,
    /// The function, or the group of functions.
    pub name: &'static str,
    /// `f32` or `f64`.
    pub scalar: &'static str,
    /// The hash of all results.
    pub hash: u64,
    /// The committed hash, if there is one.
    pub committed: Option<u64>,
}

impl Answer {
    fn new(kind: &'static str, name: &'static str, scalar: &'static str, sink: &Sink) -> Self {
        Self { kind, name, scalar, hash: sink.hash(), committed: committed(kind, name, scalar) }
    }

    /// Whether the bits are the committed ones.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.committed == Some(self.hash)
    }
}

impl Problem {
    fn ask(&self, scalar: &'static str) -> Answer {
        let mut sink = Sink::default();
        (self.call)(&mut sink);
        Answer::new("problem", self.name, scalar, &sink)
    }
}

/// Asks every capability, in both scalars. Generic, so that all of the kernel is compiled into the programs that call
/// this, and not into every one that uses this crate.
pub fn run(answered: &mut impl FnMut(Answer)) {
    let (single, double) = (Problems::<f32>::MINIMAL, Problems::<f64>::MINIMAL);
    let robust = (Problems::<f32>::ROBUST, Problems::<f64>::ROBUST);
    for (single, double) in single.iter().zip(double).chain(robust.0.iter().zip(robust.1)) {
        answered(single.ask("f32"));
        answered(double.ask("f64"));
    }
}

/// Asks the solvers and the geometry in `f32`: what fits a core with 256 kB of flash and 16 kB of RAM.
pub fn run_small(answered: &mut impl FnMut(Answer)) {
    Problems::<f32>::MINIMAL.iter().for_each(|problem| answered(problem.ask("f32")));
}

/// Asks every capability on arguments of any bits, in both scalars.
pub fn run_any_bits(answered: &mut impl FnMut(Answer)) {
    for capability in CAPABILITIES {
        for (scalar, call) in [("f32", capability.f32), ("f64", capability.f64)] {
            let mut sink = Sink::default();
            for seed in 0..ANY_BITS {
                call(&mut Source::seeded(seed), &mut sink);
            }
            answered(Answer::new("any bits", capability.name, scalar, &sink));
        }
    }
}

fn committed(kind: &str, name: &str, scalar: &str) -> Option<u64> {
    COMMITTED.lines().find_map(|line| {
        let rest = line.strip_prefix(kind)?.strip_prefix(' ')?.strip_prefix(name)?;
        let hash = rest.strip_prefix(' ')?.strip_prefix(scalar)?.strip_prefix(' ')?;
        u64::from_str_radix(hash, 16).ok()
    })
}
