//! How many solutions a function may write: the least capacity of its output.

/// Essential matrices of `epi_relpose_5pt`, poses of `epi_relpose_5pt_poses`.
pub const RELPOSE_5PT_MAX: usize = 10;
/// Fundamental matrices of `epi_relpose_7pt`.
pub const RELPOSE_7PT_MAX: usize = 3;
/// Poses of `epi_relpose_upright_3pt`.
pub const RELPOSE_UPRIGHT_3PT_MAX: usize = 4;
/// Poses of `epi_p3p`.
pub const P3P_MAX: usize = 4;
/// Poses of `epi_abspose_upright_2pt`.
pub const ABSPOSE_UPRIGHT_2PT_MAX: usize = 2;
/// Poses of `epi_abspose_npt`.
pub const ABSPOSE_NPT_MAX: usize = 4;
/// Poses of `epi_abspose_planar`.
pub const ABSPOSE_PLANAR_MAX: usize = 2;
/// Poses of `epi_essential_poses`.
pub const ESSENTIAL_POSES_MAX: usize = 4;
/// Motions of `epi_homography_motions` and `epi_homography_visible_motions`.
pub const HOMOGRAPHY_MOTIONS_MAX: usize = 4;
/// Views that `epi_triangulate_dlt` and `epi_refine_point` take at the most: they stand on the stack.
pub const POINT_MAX_VIEWS: usize = 16;
