//! A camera as it stands on a command line: numbers to parse, to hand to the kernel in either scalar, and to export.

use std::fmt;
use std::str::FromStr;

use epipole::Real;
use epipole::geometry::{BrownConrady, Camera, CameraError, KannalaBrandt, Pinhole};
use epipole::real::lit;

/// Distortion parameters in OpenCV's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    None,
    /// `k1, k2, p1, p2, k3`
    BrownConrady([f64; 5]),
    /// `k1, k2, k3, k4`
    Fisheye([f64; 4]),
}

/// Intrinsics `fx, fy, cx, cy` in pixels, and the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraParameters {
    pub intrinsics: [f64; 4],
    pub lens: Lens,
}

/// `k1,k2,k3,k4` of a fisheye lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FisheyeCoefficients(pub [f64; 4]);

impl CameraParameters {
    /// The kernel's camera.
    ///
    /// # Errors
    /// A parameter is not finite, or a focal length not positive.
    pub fn camera<T: Real>(&self) -> Result<Camera<T>, CameraError> {
        let [fx, fy, cx, cy] = self.intrinsics.map(lit::<T>);
        let pinhole = Pinhole::new(fx, fy, cx, cy)?;
        Ok(match self.lens {
            Lens::None => pinhole.into(),
            Lens::BrownConrady(k) => BrownConrady::new(pinhole, k.map(lit))?.into(),
            Lens::Fisheye(k) => KannalaBrandt::new(pinhole, k.map(lit))?.into(),
        })
    }

    /// The same camera with fisheye distortion; none where it has a distortion of another kind.
    #[must_use]
    pub fn with_fisheye(self, coefficients: FisheyeCoefficients) -> Option<Self> {
        (self.lens == Lens::None).then_some(Self { lens: Lens::Fisheye(coefficients.0), ..self })
    }

    /// COLMAP's name of the model and its parameters. COLMAP puts the centre of the top-left pixel at (1/2, 1/2).
    #[must_use]
    pub fn colmap(&self) -> (&'static str, Vec<f64>) {
        let [fx, fy, cx, cy] = self.intrinsics;
        let mut parameters = vec![fx, fy, cx + 0.5, cy + 0.5];
        let model = match self.lens {
            Lens::None => "PINHOLE",
            Lens::BrownConrady([k1, k2, p1, p2, k3]) => {
                parameters.extend([k1, k2, p1, p2]);
                if k3 == 0.0 {
                    "OPENCV"
                } else {
                    parameters.extend([k3, 0.0, 0.0, 0.0]);
                    "FULL_OPENCV"
                }
            }
            Lens::Fisheye(k) => {
                parameters.extend(k);
                "OPENCV_FISHEYE"
            }
        };
        (model, parameters)
    }
}

impl FromStr for CameraParameters {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = numbers(text)?;
        let lens = match *numbers.as_slice() {
            [_, _, _, _] => Lens::None,
            [_, _, _, _, k1, k2, p1, p2] => Lens::BrownConrady([k1, k2, p1, p2, 0.0]),
            [_, _, _, _, k1, k2, p1, p2, k3] => Lens::BrownConrady([k1, k2, p1, p2, k3]),
            _ => {
                return Err(format!(
                    "{} numbers given, 4, 8 or 9 needed: fx,fy,cx,cy[,k1,k2,p1,p2[,k3]]",
                    numbers.len()
                ));
            }
        };
        let parameters = Self { intrinsics: [numbers[0], numbers[1], numbers[2], numbers[3]], lens };
        parameters.camera::<f64>().map_err(|e| e.to_string())?;
        Ok(parameters)
    }
}

impl FromStr for FisheyeCoefficients {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = numbers(text)?;
        let array = numbers.as_slice().try_into();
        array.map(Self).map_err(|_| format!("{} numbers given, 4 needed: k1,k2,k3,k4", numbers.len()))
    }
}

impl fmt::Display for CameraParameters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lens: &[f64] = match &self.lens {
            Lens::None => &[],
            Lens::BrownConrady(k) => k,
            Lens::Fisheye(k) => k,
        };
        let text: Vec<String> = self.intrinsics.iter().chain(lens).map(f64::to_string).collect();
        f.write_str(&text.join(","))
    }
}

/// Finite numbers with commas between them.
pub fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|word| match word.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{}` is not a number", word.trim())),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> CameraParameters {
        text.parse().unwrap()
    }

    #[test]
    fn strings_come_back() {
        for text in ["500,501,320,240", "500,501,320,240,-0.3,0.1,0.001,-0.002,0.01"] {
            assert_eq!(parse(text).to_string(), text);
        }
        assert_eq!(parse(" 500, 501 ,320,240,1,2,3,4"), parse("500,501,320,240,1,2,3,4,0"));
    }

    #[test]
    fn models_of_colmap() {
        let name = |c: CameraParameters| (c.colmap().0, c.colmap().1.len());
        assert_eq!(name(parse("500,500,320,240")), ("PINHOLE", 4));
        assert_eq!(name(parse("500,500,320,240,1,2,3,4")), ("OPENCV", 8));
        assert_eq!(name(parse("500,500,320,240,1,2,3,4,5")), ("FULL_OPENCV", 12));
        let fisheye = FisheyeCoefficients([0.1, 0.2, 0.3, 0.4]);
        let camera = parse("500,500,320,240").with_fisheye(fisheye).unwrap();
        assert_eq!(camera.colmap(), ("OPENCV_FISHEYE", vec![500.0, 500.0, 320.5, 240.5, 0.1, 0.2, 0.3, 0.4]));
        assert!(camera.with_fisheye(fisheye).is_none());
    }
}
