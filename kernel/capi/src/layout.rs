//! The sizes of structs that C programs are compiled with, in `f32` and `f64`: the same on every target, or this does not compile.

use crate::{estimates::*, options::*, types::*};

macro_rules! sizes {
    ($($name:ident: $single:literal $double:literal;)*) => {
        const _: () = {
            $(assert!(size_of::<$name<f32>>() == $single && align_of::<$name<f32>>() <= 8);)*
            $(assert!(size_of::<$name<f64>>() == $double && align_of::<$name<f64>>() == 8);)*
        };
    };
}

// Where `double` is aligned to less than eight bytes, some have no padding.
#[cfg(not(target_arch = "x86"))]
sizes! {
    Camera: 52 104;
    RelativePoseOptions: 136 232;
    RefineTwoViewOptions: 16 24;
    RefinedTwoView: 52 96;
    SearchReport: 48 64;
    Pose: 28 56;
    RelativePoseEstimate: 816 1576;
    HomographyOptions: 48 56;
    HomographyEstimate: 392 736;
    FundamentalOptions: 48 56;
    FundamentalEstimate: 96 152;
    AbsolutePoseOptions: 80 120;
    AbsolutePoseEstimate: 432 808;
    RefinedRelativePose: 132 264;
    RefineAbsolutePoseOptions: 196 376;
    RefinedAbsolutePose: 192 376;
    TriangulatedPoint: 24 40;
    RefinedPoint: 64 120;
}

#[cfg(all(feature = "bundle", not(target_arch = "x86")))]
mod windows {
    use crate::window::*;
    sizes! {
        BundleOptions: 36 56;
        FrameCovariance: 324 648;
        BundleReport: 40 48;
        PointReport: 16 24;
    }
}
