//! What users call: from pixels and cameras to a verdict, robustly.
//!
//! | from two views | answers |
//! |---|---|
//! | [`relative_pose`] | the pose of view 2 in the frame of view 1, or why there is none |
//!
//! | from one view of known points | answers |
//! |---|---|
//! | [`absolute_pose`] | the camera's pose in the world, both poses of an ambiguous plane, or why there is none |

mod absolute_pose;
mod load;
mod relative_pose;
mod workspace;

pub use absolute_pose::{
    AbsolutePose, AbsolutePoseError, AbsolutePoseEstimate, AbsolutePoseOptions, AbsolutePoseStorage,
    AbsolutePoseVerdict, AbsolutePoseWorkspace, GravityFit, GravityPrior, WideAbsolutePoseStorage,
    absolute_pose, absolute_pose_guided,
};
pub use relative_pose::{
    GeneralMotion, PlanarPose, PureRotation, RelativePoseError, RelativePoseEstimate, RelativePoseOptions,
    RelativePoseVerdict, Unobservable, relative_pose, relative_pose_guided,
};
pub use workspace::{
    RelativePoseStorage, RelativePoseWorkspace, TwoViewStorage, TwoViewWorkspace, WideTwoViewStorage,
};
