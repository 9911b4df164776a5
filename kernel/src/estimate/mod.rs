//! What users call: from pixels and cameras to a verdict, robustly.
//!
//! | from two views | answers |
//! |---|---|
//! | [`relative_pose`] | the pose of view 2 in the frame of view 1, or why there is none |

mod load;
mod relative_pose;
mod workspace;

pub use relative_pose::{
    GeneralMotion, PlanarPose, PureRotation, RelativePoseError, RelativePoseEstimate, RelativePoseOptions,
    RelativePoseVerdict, Unobservable, relative_pose, relative_pose_guided,
};
pub use workspace::{
    RelativePoseStorage, RelativePoseWorkspace, TwoViewStorage, TwoViewWorkspace, WideTwoViewStorage,
};
