//! What users call: from pixels and cameras to a verdict, robustly.
//!
//! | from two views | answers |
//! |---|---|
//! | [`relative_pose`] | the pose of view 2 in the frame of view 1, or why there is none |
//! | [`homography`] | the homography between two images of a plane or of a turning camera, or why there is none |
//! | [`fundamental`] | the fundamental matrix of uncalibrated cameras, the homography of a planar scene, or why there is none |
//!
//! | from one view of known points | answers |
//! |---|---|
//! | [`absolute_pose`] | the camera's pose in the world, both poses of an ambiguous plane, or why there is none |

mod absolute_pose;
mod chance;
mod degenerate;
mod error;
mod frame;
mod fundamental;
mod homography;
mod load;
mod near;
mod neighbours;
mod prior;
mod relative_pose;
mod scatter;
mod transfer;
mod workspace;

pub use absolute_pose::{
    AbsolutePose, AbsolutePoseError, AbsolutePoseEstimate, AbsolutePoseOptions, AbsolutePoseStorage,
    AbsolutePoseVerdict, AbsolutePoseWorkspace, GravityPrior, WideAbsolutePoseStorage, absolute_pose,
    absolute_pose_guided,
};
pub use error::TwoViewError;
pub use fundamental::{
    FundamentalError, FundamentalEstimate, FundamentalOptions, FundamentalStorage, FundamentalVerdict,
    FundamentalWorkspace, fundamental, fundamental_guided,
};
pub use homography::{
    FoundHomography, HomographyError, HomographyEstimate, HomographyOptions, HomographyStorage,
    HomographyVerdict, HomographyWorkspace, homography, homography_guided,
};
pub use prior::PriorFit;
pub use relative_pose::{
    GeneralMotion, PlanarPose, PureRotation, RelativePoseError, RelativePoseEstimate, RelativePoseOptions,
    RelativePosePrior, RelativePoseVerdict, Unobservable, refine_relative_pose, relative_pose,
    relative_pose_guided,
};
pub use workspace::{
    RelativePoseStorage, RelativePoseWorkspace, TwoViewStorage, TwoViewWorkspace, WideTwoViewStorage,
};

/// A stride near the golden ratio of `count` and coprime to it: steps of it visit every entry of a list once, and early
/// ones are spread over the whole list, so that an order in the input (best match first) does not mislead an early
/// exit.
#[cfg_attr(small, inline(never))]
pub(crate) fn stride(count: usize) -> usize {
    let first = count * 5 / 8;
    (first..first + 64).find(|&stride| gcd(stride, count) == 1).unwrap_or(1)
}

fn gcd(mut a: usize, mut b: usize) -> usize {
    for _ in 0..128 {
        if b == 0 {
            break;
        }
        (a, b) = (b, a % b);
    }
    a
}
