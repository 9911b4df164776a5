//! Arbitrary bytes through every function of the C interface. Pointers are null, misaligned, shared by two arguments, or
//! sound; counts are small, or larger than any memory. Nothing panics, and a call that answers an error has written nothing but
//! a workspace.

use std::ffi::c_void;

use epipole::Real;
use epipole::nalgebra::Vector3;
use epipole_capi::enums::KeepGoing;
use epipole_capi::estimates::*;
use epipole_capi::options::*;
use epipole_capi::types::*;
use epipole_capi::window::{BundleOptions, BundleReport, FrameCovariance, PointReport, Window};
use epipole_exercise::Source;

/// Bytes for each pointer, enough for `MANY` of the largest element.
const ROOM: usize = 1 << 19;
/// The most elements that a sound call is told of.
const MANY: usize = 4096;
/// Bytes at the head of each room that arguments come from, and that are compared after an error.
const HEAD: usize = 1 << 13;
/// Bytes of a workspace, and of a window's memory.
const WORKSPACE: usize = 1 << 16;
const SLOTS: usize = 16;

/// The memory of a call.
pub struct Arena {
    words: Vec<u64>,
    before: Vec<u8>,
}

impl Default for Arena {
    fn default() -> Self {
        Self { words: vec![0; SLOTS * ROOM / 8], before: vec![0; SLOTS * HEAD] }
    }
}

impl Arena {
    fn head(&mut self, slot: usize) -> &mut [u8] {
        let start = self.words.as_mut_ptr().cast::<u8>();
        // SAFETY: numbers as bytes, inside the room.
        unsafe { std::slice::from_raw_parts_mut(start.add(slot * ROOM), HEAD) }
    }

    fn remember(&mut self, slots: usize) {
        for slot in 0..slots {
            let mut before = std::mem::take(&mut self.before);
            before[slot * HEAD..][..HEAD].copy_from_slice(self.head(slot));
            self.before = before;
        }
    }

    fn changed(&mut self, slot: usize) -> bool {
        let before = std::mem::take(&mut self.before);
        let changed = self.head(slot) != &before[slot * HEAD..][..HEAD];
        self.before = before;
        changed
    }
}

/// The arguments of a call in the making.
pub struct Args<'a, 's> {
    source: &'a mut Source<'s>,
    arena: &'a mut Arena,
    slot: usize,
    /// What the next size should say.
    size: Option<usize>,
    workspaces: u32,
}

/// What may stand behind a pointer.
trait Content: Sized {
    /// Its size, where an argument after the pointer tells it.
    const SIZE: Option<usize> = Some(size_of::<Self>());
    /// Whether it is a workspace, whose content means nothing.
    const WORKSPACE: bool = false;

    fn fill(source: &mut Source<'_>, head: &mut [u8]);
}

fn write<T: Copy>(head: &mut [u8], values: impl IntoIterator<Item = T>) {
    let start = head.as_mut_ptr().cast::<T>();
    for (k, value) in values.into_iter().take(HEAD / size_of::<T>()).enumerate() {
        // SAFETY: inside the head, which is aligned for everything; plain numbers.
        unsafe { start.add(k).write(value) };
    }
}

fn bytes(source: &mut Source<'_>, head: &mut [u8], count: usize) {
    head.iter_mut().take(count).for_each(|byte| *byte = source.byte());
}

macro_rules! content_of_numbers {
    ($($scalar:ident)*) => {$(
        impl Content for $scalar {
            const SIZE: Option<usize> = None;
            fn fill(source: &mut Source<'_>, head: &mut [u8]) {
                write(head, (0..80).map(|_| source.scalar::<$scalar>()));
            }
        }
        impl Content for Window<$scalar> {
            // A window holds the numbers that an optimisation works on.
            const WORKSPACE: bool = true;
            fn fill(source: &mut Source<'_>, head: &mut [u8]) {
                window::$scalar(source, head.as_mut_ptr());
            }
        }
        impl Content for *mut Window<$scalar> {
            fn fill(_: &mut Source<'_>, _: &mut [u8]) {}
        }
    )*};
}
content_of_numbers!(f32 f64);

macro_rules! content_of_outputs {
    ($($name:ident)*) => {$(
        impl<T: Real> Content for $name<T> {
            fn fill(source: &mut Source<'_>, head: &mut [u8]) {
                bytes(source, head, 16);
            }
        }
    )*};
}
content_of_outputs!(
    RelativePoseEstimate RefinedRelativePose HomographyEstimate FundamentalEstimate AbsolutePoseEstimate
    RefinedAbsolutePose RefinedTwoView TriangulatedPoint RefinedPoint BundleReport PointReport FrameCovariance
);

/// A window with some content; or memory that is none.
mod window {
    use super::*;

    macro_rules! fill {
        ($scalar:ident) => {
            pub(super) fn $scalar(source: &mut Source<'_>, start: *mut u8) {
                use epipole_capi::$scalar::window::*;
                let mut window = std::ptr::null_mut();
                if source.below(16) == 0 {
                    // SAFETY: inside the head.
                    return unsafe { start.write_bytes(source.byte(), 64) };
                }
                // SAFETY: the head is aligned and larger; all other pointers are of locals.
                unsafe {
                    assert_eq!(window_create(start.cast(), HEAD, 3, 6, 16, 1, &mut window), 0);
                    let camera =
                        Camera::<$scalar> { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, ..Camera::default() };
                    for k in 0..3 {
                        let pose =
                            Pose { rotation: [0.0, 0.0, 0.0, 1.0], translation: [-(k as $scalar), 0.0, 0.0] };
                        let mut frame = 0;
                        assert_eq!(window_add_frame(window, &camera, &pose, &mut frame), 0);
                        assert_eq!(window_fix_frame(window, frame, u32::from(k + 1 < source.below(3))), 0);
                    }
                    for _ in 0..source.below(7) {
                        let position =
                            [source.moderate(), source.moderate(), source.moderate::<$scalar>() + 6.0];
                        let mut point = 0;
                        assert_eq!(window_add_point(window, position.as_ptr(), &mut point), 0);
                    }
                    for _ in 0..source.below(20) {
                        let pixel = [
                            320.0 + 80.0 * source.moderate::<$scalar>(),
                            240.0 + 80.0 * source.moderate::<$scalar>(),
                        ];
                        let (frame, point) = (source.below(3) as u32, source.below(6) as u32);
                        window_add_observation(window, frame, point, pixel.as_ptr(), 1.0);
                    }
                }
            }
        };
    }
    fill!(f32);
    fill!(f64);
}

/// Options as their function fills them, now and then with any bits in some places.
macro_rules! content_of_options {
    ($($name:ident $module:ident $default:ident $most:ident;)*) => {$(
        content_of_options!(@one f32 $name $module $default $most);
        content_of_options!(@one f64 $name $module $default $most);
    )*};
    (@one $scalar:ident $name:ident $module:ident $default:ident $most:ident) => {
        impl Content for $name<$scalar> {
            fn fill(source: &mut Source<'_>, head: &mut [u8]) {
                let size = size_of::<Self>();
                // SAFETY: the head is aligned and larger.
                let answer = unsafe { epipole_capi::$scalar::$module::$default(head.as_mut_ptr().cast(), size) };
                assert_eq!(answer, 0);
                // SAFETY: just written. Few iterations, so that many calls are made.
                unsafe { (*head.as_mut_ptr().cast::<Self>()).$most = 1 + source.below(16) as u32 };
                for _ in 0..source.below(4) {
                    let at = source.below(256) % size;
                    head[at] = source.byte();
                }
            }
        }
    };
}
content_of_options!(
    RelativePoseOptions estimate relative_pose_options_default max_iterations;
    HomographyOptions estimate homography_options_default max_iterations;
    FundamentalOptions estimate fundamental_options_default max_iterations;
    AbsolutePoseOptions estimate absolute_pose_options_default max_iterations;
    RefineAbsolutePoseOptions refine refine_absolute_pose_options_default max_passes;
    RefineTwoViewOptions refine refine_two_view_options_default max_passes;
    BundleOptions window bundle_options_default max_iterations;
);

impl Content for u8 {
    const SIZE: Option<usize> = None;
    fn fill(source: &mut Source<'_>, head: &mut [u8]) {
        bytes(source, head, 32);
    }
}

impl Content for u32 {
    const SIZE: Option<usize> = None;
    fn fill(source: &mut Source<'_>, head: &mut [u8]) {
        bytes(source, head, 32);
    }
}

impl Content for c_void {
    const SIZE: Option<usize> = Some(WORKSPACE);
    const WORKSPACE: bool = true;
    fn fill(source: &mut Source<'_>, head: &mut [u8]) {
        bytes(source, head, 64);
    }
}

impl<T: Real> Content for Pose<T> {
    const SIZE: Option<usize> = None;
    fn fill(source: &mut Source<'_>, head: &mut [u8]) {
        let each = |source: &mut Source<'_>| {
            let q = source.rotation::<T>();
            let t: Vector3<T> = source.vector3();
            Self { rotation: [q.i, q.j, q.k, q.w], translation: t.into() }
        };
        write(head, (0..20).map(|_| each(source)));
    }
}

impl<T: Real> Content for Camera<T> {
    const SIZE: Option<usize> = None;
    fn fill(source: &mut Source<'_>, head: &mut [u8]) {
        let each = |source: &mut Source<'_>| {
            let mut camera = Self {
                model: source.below(4) as u32,
                fx: source.positive(),
                fy: source.positive(),
                cx: source.scalar(),
                cy: source.scalar(),
                distortion: [T::ZERO; 8],
            };
            if source.below(2) == 1 {
                camera.distortion = source.array();
            }
            camera
        };
        write(head, (0..20).map(|_| each(source)));
    }
}

/// An argument of any bits that a C program may pass.
trait Any {
    fn any(args: &mut Args<'_, '_>) -> Self;
}

fn pointer<V: Content>(args: &mut Args<'_, '_>) -> *mut V {
    args.size = V::SIZE;
    let choice = args.source.below(32);
    if choice == 0 {
        return std::ptr::null_mut();
    }
    let mut slot = args.slot;
    if choice == 1 && slot > 0 {
        slot -= 1;
        // What lies there is an argument of another kind; it must be large enough for both, and is.
    } else {
        args.slot += 1;
        let Args { source, arena, .. } = args;
        V::fill(source, arena.head(slot));
    }
    args.workspaces |= u32::from(V::WORKSPACE) << slot;
    let start = args.arena.head(slot).as_mut_ptr();
    // SAFETY: inside the room.
    (if choice == 2 { unsafe { start.add(1) } } else { start }).cast()
}

impl<V: Content> Any for *mut V {
    fn any(args: &mut Args<'_, '_>) -> Self {
        pointer(args)
    }
}

impl<V: Content> Any for *const V {
    fn any(args: &mut Args<'_, '_>) -> Self {
        pointer(args)
    }
}

impl Any for usize {
    fn any(args: &mut Args<'_, '_>) -> Self {
        match (args.size.take(), args.source.byte()) {
            (_, 0) => [usize::MAX, usize::MAX / 2, 1 << 62, usize::MAX / 24][args.source.below(4)],
            (_, 1) => MANY,
            (Some(size), 2..) => size,
            _ => args.source.below(21),
        }
    }
}

impl Any for u32 {
    fn any(args: &mut Args<'_, '_>) -> Self {
        match args.source.byte() {
            0 => (0..4).fold(0, |bits, _| bits << 8 | u32::from(args.source.byte())),
            byte => u32::from(byte) % 4,
        }
    }
}

impl Any for f32 {
    fn any(args: &mut Args<'_, '_>) -> Self {
        args.source.scalar()
    }
}

impl Any for f64 {
    fn any(args: &mut Args<'_, '_>) -> Self {
        args.source.scalar()
    }
}

unsafe extern "C" fn at_most_twice(_: *mut c_void, iterations: u32) -> i32 {
    i32::from(iterations < 16)
}

impl Any for KeepGoing {
    fn any(args: &mut Args<'_, '_>) -> Self {
        (args.source.below(2) == 1).then_some(at_most_twice)
    }
}

/// What functions answer.
trait Answer {
    fn is_error(&self) -> bool;
}

impl Answer for i32 {
    fn is_error(&self) -> bool {
        *self < 0
    }
}

impl Answer for usize {
    fn is_error(&self) -> bool {
        false
    }
}

impl Args<'_, '_> {
    fn finish(&mut self, answer: impl Answer) {
        if answer.is_error() {
            for slot in (0..self.slot).filter(|slot| self.workspaces >> slot & 1 == 0) {
                assert!(!self.arena.changed(slot), "an error has written into argument {slot}");
            }
        }
    }
}

macro_rules! calls {
    ($name:ident: $($argument:ident)*) => {
        #[allow(non_snake_case)]
        fn $name<$($argument: Any,)* R: Answer>(
            f: unsafe extern "C" fn($($argument),*) -> R,
            source: &mut Source<'_>,
            arena: &mut Arena,
        ) {
            let mut args = Args { source, arena, slot: 0, size: None, workspaces: 0 };
            $(let $argument = $argument::any(&mut args);)*
            args.arena.remember(args.slot);
            // SAFETY: every pointer is null, misaligned or points to a room that holds what sizes and counts say.
            let answer = unsafe { f($($argument),*) };
            args.finish(answer);
        }
    };
}
calls!(call1: A);
calls!(call2: A B);
calls!(call3: A B C);
calls!(call4: A B C D);
calls!(call5: A B C D E);
calls!(call6: A B C D E F);
calls!(call7: A B C D E F G);
calls!(call8: A B C D E F G H);
calls!(call9: A B C D E F G H I);
calls!(call10: A B C D E F G H I J);
calls!(call11: A B C D E F G H I J K);
calls!(call12: A B C D E F G H I J K L);
calls!(call13: A B C D E F G H I J K L M);
calls!(call14: A B C D E F G H I J K L M N);

/// A function of C with arguments out of bytes.
pub type Function = fn(&mut Source<'_>, &mut Arena);

macro_rules! functions {
    ($scalar:ident: $($module:ident $call:ident: $($function:ident)*;)*) => {
        &[$($((
            concat!("epi_", stringify!($function), "_", stringify!($scalar)),
            (|source, arena| $call(epipole_capi::$scalar::$module::$function, source, arena)) as Function,
        ),)*)*]
    };
}

macro_rules! both {
    ($($table:tt)*) => {
        /// Every function of C with a scalar.
        pub const FUNCTIONS: [&[(&str, Function)]; 2] = [functions!(f32: $($table)*), functions!(f64: $($table)*)];
    };
}
both! {
    camera call4: camera_project_with_jacobian camera_unproject_with_jacobian;
    camera call5: camera_project camera_unproject;
    estimate call1: homography_workspace_size fundamental_workspace_size;
    estimate call2: relative_pose_options_default relative_pose_workspace_size homography_options_default fundamental_options_default absolute_pose_options_default absolute_pose_workspace_size;
    estimate call9: homography fundamental;
    estimate call10: absolute_pose;
    estimate call11: relative_pose;
    estimate call12: homography_guided fundamental_guided refine_relative_pose;
    estimate call13: absolute_pose_guided;
    estimate call14: relative_pose_guided;
    geometry call2: pose_centre rotation_exp rotation_log nearest_rotation upright tangent_basis essential_from_pose essential_nearest fundamental_nearest homography_inverse;
    geometry call3: pose_from_matrix pose_matrix pose_relative pose_retract essential_poses fundamental_epipoles;
    geometry call4: essential_from_fundamental essential_to_fundamental homography_motions homography_to_pixels homography_to_normalised;
    geometry call5: homography_transfer in_front_of_both;
    geometry call6: essential_pose_by_cheirality homography_visible_motions;
    refine call2: refine_absolute_pose_options_default refine_two_view_options_default;
    refine call3: find_not_finite;
    refine call7: refine_homography refine_fundamental;
    refine call8: refine_absolute_pose;
    residual call6: sampson symmetric_epipolar_sq transfer;
    residual call7: symmetric_transfer_sq reprojection reprojection_with_jacobians;
    solvers call3: homography_4pt decompose_projection rotation_2pt;
    solvers call4: relpose_5pt relpose_5pt_poses relpose_7pt relpose_8pt fundamental_8pt relpose_upright_3pt homography_npt p3p abspose_upright_2pt resection_dlt rotation_npt translation_2pt absolute_orientation_npt;
    solvers call5: abspose_npt translation_npt absolute_orientation_with_scale_npt;
    solvers call6: abspose_planar;
    triangulation call4: triangulate_dlt parallax point_covariance;
    triangulation call6: refine_point;
    triangulation call7: triangulate;
    window call1: window_clear window_frame_count window_point_count window_observation_count window_prior_frame_count window_clear_prior;
    window call2: bundle_options_default window_remove_frame window_remove_point window_remove_pose_prior window_remove_distance;
    window call3: window_fix_frame window_pose window_set_pose window_add_point window_fix_point window_position window_set_position window_remove_observation window_frames window_points;
    window call4: window_size window_add_frame window_set_position_prior window_set_rotation_prior window_set_pose_prior window_marginalise_frame window_marginalise_point;
    window call5: window_add_observation window_observations_of window_set_distance window_frame_covariance window_point_covariance window_refine_frame window_refine_point window_point_report;
    window call6: window_optimise;
    window call7: window_create;
}

/// One function, chosen by the first byte, on the other bytes.
pub fn run(data: &[u8]) {
    thread_local! {
        static ARENA: std::cell::RefCell<Arena> = std::cell::RefCell::default();
    }
    let [choice, rest @ ..] = data else { return };
    let [single, double] = FUNCTIONS;
    let (_, function) = single.iter().chain(double).nth(usize::from(*choice)).unwrap_or(&single[0]);
    ARENA.with_borrow_mut(|arena| function(&mut Source::new(rest), arena));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_of_the_header_is_called() {
        let header = include_str!("../../kernel/capi/include/epipole.h");
        let declared = header
            .split_whitespace()
            .map(|word| word.trim_start_matches('*'))
            .filter_map(|word| word.split_once('(').map(|(name, _)| name))
            .filter(|name| name.starts_with("epi_") && (name.ends_with("_f32") || name.ends_with("_f64")));
        let called: Vec<&str> =
            FUNCTIONS.iter().flat_map(|list| list.iter().map(|(name, _)| *name)).collect();
        let mut count = 0;
        for name in declared {
            assert!(called.contains(&name), "{name} is not called");
            count += 1;
        }
        assert_eq!(count, called.len());
        assert!(called.len() <= 256, "one byte chooses");
    }

    #[test]
    fn any_bits_break_no_rule() {
        let mut arena = Arena::default();
        for (name, function) in FUNCTIONS.concat() {
            for seed in 0..12 {
                let mut source = Source::seeded(seed);
                let call = std::panic::AssertUnwindSafe(|| function(&mut source, &mut arena));
                assert!(std::panic::catch_unwind(call).is_ok(), "{name}, seed {seed}");
            }
        }
    }
}
