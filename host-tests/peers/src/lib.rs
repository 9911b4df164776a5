//! Symbols that the comparison programs load: each converts types and calls one public function.
//!
//! A task `bench_<task>_<scalar>(a, b, out)` takes one problem, writes its solutions row-major one after the other and
//! returns how many there are.

pub mod solvers;
//! `int bench_<task>_<scalar>(const T *a, const T *b, T *out)` returns the number of solutions; matrices are row-major,
//! a pose is a row-major rotation matrix followed by the translation.

mod two_view;

/// Where a symbol writes its solutions, one after the other.
struct Output<T> {
    next: *mut T,
    count: i32,
}

impl<T: Copy> Output<T> {
    /// Appends one solution.
    fn push<const N: usize>(&mut self, values: [T; N]) {
        // SAFETY: the caller of the symbol gives room for all solutions.
        unsafe {
            self.next.cast::<[T; N]>().write_unaligned(values);
            self.next = self.next.add(N);
        }
        self.count += 1;
    }
}

/// A symbol for each scalar: `a` and `b` are arrays of the given lengths, `out` an [`Output`].
macro_rules! symbols {
    ($f32:ident, $f64:ident, |$a:ident: $na:literal, $b:ident: $nb:literal, $out:ident| $body:expr) => {
        $crate::symbols!(@one $f32, f32, $a: $na, $b: $nb, $out, $body);
        $crate::symbols!(@one $f64, f64, $a: $na, $b: $nb, $out, $body);
    };
    (@one $name:ident, $t:ty, $a:ident: $na:literal, $b:ident: $nb:literal, $out:ident, $body:expr) => {
        /// # Safety
        /// The pointers lead to arrays of the lengths of the task; `out` holds all solutions.
        #[unsafe(no_mangle)]
        #[allow(unreachable_pub)]
        pub unsafe extern "C" fn $name(a: *const $t, b: *const $t, out: *mut $t) -> i32 {
            // SAFETY: the lengths are the caller's promise.
            let ($a, $b) = unsafe { (&*a.cast::<[$t; $na]>(), &*b.cast::<[$t; $nb]>()) };
            let mut $out = $crate::Output { next: out, count: 0 };
            $body;
            $out.count
        }
    };
}
pub(crate) use symbols;
