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

use std::error::Error;
use std::process::ExitCode;

/// How a program ends: an error is told on the standard error stream.
pub fn exit_code(result: Result<(), Box<dyn Error>>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::FAILURE
        }
    }
}
