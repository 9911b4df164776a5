//! What the example programs share: a scene that renders itself, image features and their matching, drawing and
//! export. All of it is host code; the geometry is epipole's.

pub mod align;
pub mod canvas;
pub mod export;
pub mod features;
pub mod lens;
pub mod matching;
pub mod noise;
pub mod picture;
pub mod pyramid;
pub mod render;
pub mod texture;
pub mod track;
pub mod two_view;
pub mod window;
