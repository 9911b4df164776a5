//! What is measured: every solver, the geometry of inner loops, every estimator, refinements and the steps of a
//! bundle window, each on a small fixed set of problems, in both scalars.
//!
//! ```sh
//! cargo bench -p epipole-bench --features time                    # time, by criterion
//! .ci/run budget                                                  # instructions, beside the committed budget
//! EPIPOLE_UPDATE_GOLDEN=1 .ci/run budget                          # the budget anew
//! ```

mod bundle;
mod estimate;
mod geometry;
mod linalg;
mod solvers;

/// Calls of one function, ready to be measured.
pub struct Run {
    /// How many calls `body` makes.
    pub calls: usize,
    /// Makes them, the same ones each time.
    pub body: Box<dyn FnMut()>,
}

impl Run {
    /// A run that calls `call` once with each input. What a call returns is not moved, since that may be a call of
    /// `memcpy`, and that one's instructions depend on the processor.
    fn each<I: 'static, O>(inputs: Vec<I>, call: impl Fn(&I) -> O + 'static) -> Self {
        Self {
            calls: inputs.len(),
            body: Box::new(move || {
                for input in &inputs {
                    std::hint::black_box(&call(std::hint::black_box(input)));
                }
            }),
        }
    }
}

/// A function in one scalar, on its problems.
#[derive(Clone, Copy)]
pub struct Case {
    /// The function's name, with the size of its input where it takes any.
    pub name: &'static str,
    /// `f32` or `f64`.
    pub scalar: &'static str,
    /// Makes the problems. Not measured.
    pub prepare: fn() -> Run,
}

/// The table of a module: each function `fn name<T: Real>() -> Run` in both scalars.
macro_rules! both_scalars {
    ($($name:ident),* $(,)?) => {
        pub(crate) fn cases() -> Vec<crate::Case> {
            vec![$(
                crate::Case { name: stringify!($name), scalar: "f32", prepare: $name::<f32> },
                crate::Case { name: stringify!($name), scalar: "f64", prepare: $name::<f64> },
            )*]
        }
    };
}
pub(crate) use both_scalars;

/// Everything that is measured, in a fixed order.
pub fn cases() -> Vec<Case> {
    let modules: [fn() -> Vec<Case>; 5] =
        [solvers::cases, geometry::cases, linalg::cases, estimate::cases, bundle::cases];
    let mut all: Vec<Case> = modules.iter().flat_map(|cases| cases()).collect();
    all.push(solvers::RELPOSE_5PT_WIDE);
    all
}
